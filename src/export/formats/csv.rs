//! Comma-separated values: a row a frame.

use super::sampled::SampledMotion;
use gaitwright_physics::fault::InputError;

/// Columns before those of the joints.
const ROOT: [&str; 9] =
    ["clip", "time", "root_x", "root_y", "root_z", "root_qw", "root_qx", "root_qy", "root_qz"];

/// The entry and one cycle of the loop, on one clock: `clip` is `entry` or `loop`. Then the root link in the world
/// frame (m, unit quaternion), the angle of each joint (rad or m) in a column of its name, and its target in a column
/// `NAME_target`. The loop's last row is its first one cycle later.
pub(super) fn write(sampled: &SampledMotion<'_>, in_place: bool) -> Result<Vec<u8>, InputError> {
    let mut table = csv::Writer::from_writer(Vec::new());
    let failed = |error: csv::Error| InputError::impossible("", error.to_string());
    let joints = sampled.joints();
    let names = ROOT.into_iter().map(str::to_owned);
    let targets = joints.iter().map(|joint| format!("{joint}_target"));
    table.write_record(names.chain(joints.iter().cloned()).chain(targets)).map_err(failed)?;
    let mut start = 0.0;
    for (name, clip) in [("entry", sampled.entry.as_ref()), ("loop", Some(&sampled.cycle))] {
        let Some(clip) = clip else { continue };
        for frame in &clip.frames {
            let root = frame.placed_root(in_place);
            let (p, q) = (root.translation.vector, root.rotation);
            let root = [start + frame.time, p.x, p.y, p.z, q.w, q.i, q.j, q.k];
            let numbers = root.iter().chain(&frame.angles).chain(&frame.targets);
            table
                .write_record(std::iter::once(name.to_owned()).chain(numbers.map(f64::to_string)))
                .map_err(failed)?;
        }
        start += clip.duration();
    }
    table.into_inner().map_err(|error| InputError::impossible("", error.to_string()))
}
