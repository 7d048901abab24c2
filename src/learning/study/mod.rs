//! The open questions of the paper, and rival searches, on equal budgets of simulated time.
//!
//! Tokizaki & Hasegawa ask in their section 5 whether more generations would bring the gaits of animals, whether the
//! locked trunk is to blame that they did not come, and what keeping transitions would save. Each question is answered by
//! a few variants of the search that differ in that alone, each run with the same number of seeds and for the same
//! simulated time, so that the answer depends neither on the machine nor on what else it does. The variants all move the
//! same character, driven with the same springs and dampers, toward the same speed; what each run found is judged by
//! what it costs as a natural gait and by the gait report, whatever the run itself was paid for.
//!
//! | in the order of use | |
//! |---|---|
//! | [`variants`] | the questions, and the variants that answer them |
//! | [`arena`](mod@arena) | who moves, where, how fast, and what a motion costs |
//! | `qdsega`, `programs` | a run of QDSEGA; of leg programs |
//! | `keyframes`, `rivals` | searches of cyclic keyframes without Q-learning |
//! | [`run`](fn@run), [`LearningTable`] | all runs, and what came out |

pub mod arena;
mod judged;
mod keyframes;
mod programs;
mod qdsega;
mod rivals;
mod runs;
mod table;
mod trail;
pub mod variants;

pub use judged::{JudgedMotion, JudgedRun};
pub use runs::{LearningStudy, StudyProgress, run};
pub use table::{LearningTable, LearningTableFormat, MedianRange, StudiedTask, VariantRow};
