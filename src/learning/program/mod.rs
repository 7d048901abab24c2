//! Leg programs: natural gaits for any number of legs, from a force template, polished by CMA-ES; and waves along bodies without
//! legs, polished in the same way.
//!
//! A gait is written in some twenty numbers that have a meaning for every character (stride time, duty
//! factors, lift, where the feet stand …) instead of in joint angles. A template of the forces that the
//! legs have to give turns them into the course of the trunk and the paths of the feet, inverse kinematics
//! into joint angles, and the springs of the drive into targets that lead those angles by what the forces
//! ask for. All numbers at 0 is the gait as the template has it, which several characters walk and trot
//! with at once; an evolution strategy does the rest.
//!
//! | in the order of use | |
//! |---|---|
//! | [`legs`], `sole` | hips, chains of joints and foot points; left and right, fore and hind by the task's direction |
//! | [`closing`] | the joints that closed loops move along with those chains |
//! | [`gaits`], [`no_gaits`] | phases and duty factors by name; why a character has none |
//! | [`gains`] | springs and dampers of the drive |
//! | [`template`] | forces of the legs, and how the trunk moves under them |
//! | [`ring`], [`entry`] | a stride as a ring of keyframes, and what leads into it |
//! | [`steer`] | feedback through cells of the trunk |
//! | [`spine`], [`wave`] | bodies without legs, and their waves as such rings |
//! | [`disturbance`] | what a gait has to withstand |
//! | [`rollout`], [`figures`], [`leg_watch`] | such a ring in the simulator, and what is seen of it and of each leg |
//! | [`cost`] | what that costs |
//! | [`cma`] | the evolution strategy |
//! | [`subject`], [`candidate`] | who is to move where, and a gait that was tried there |
//! | [`straightening`] | how the way of a gait is set straight |
//! | [`seeds`], [`starts`], [`searched`] | where a search may begin, where it does, and which parameters it changes |
//! | [`refine`] | a gait for a character at a speed |

pub mod candidate;
pub mod closing;
pub mod cma;
pub mod cost;
pub mod disturbance;
mod ends;
pub mod entry;
pub mod figures;
pub mod gains;
pub mod gaits;
pub mod leg_watch;
pub mod legs;
pub mod no_gaits;
pub mod refine;
pub mod ring;
pub mod rollout;
pub mod searched;
pub mod seeds;
mod sole;
pub mod spine;
pub mod starts;
pub mod steer;
pub mod straightening;
pub mod subject;
pub mod template;
pub mod wave;
