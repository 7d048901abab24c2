//! The command `export`, as a shell sees it.

use std::fs::File;
use std::path::Path;
use std::process::{Command, Output};

use tempfile::TempDir;

use super::{Example, MOTION};
use crate::common::example_path;
use gaitwright::export::{ExportFormat, ExportOptions};

fn run(arguments: &[&str], out: &Path) -> Output {
    let motion = File::open(Path::new(env!("CARGO_MANIFEST_DIR")).join(MOTION)).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_gaitwright"));
    command.args(["export", "-"]).args(arguments).arg("--out").arg(out).stdin(motion);
    command.output().unwrap()
}

#[test]
fn every_format_is_written_and_the_same_bytes_each_time() {
    let (folder, example) = (TempDir::new().unwrap(), Example::new());
    let character = example_path("quadruped.urdf");
    let character = character.to_str().unwrap();
    for format in ExportFormat::ALL {
        let path = folder.path().join(format.name());
        let output = run(&["--character", character, "--format", format.name(), "--fps", "30"], &path);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let options = ExportOptions { fps: 30.0, in_place: false };
        assert!(std::fs::read(&path).unwrap() == example.export(format, options), "{}", format.name());
    }
    let output = run(&["--character", character, "--format", "csv", "--in-place"], Path::new("-"));
    let options = ExportOptions { in_place: true, ..ExportOptions::default() };
    assert_eq!(output.stdout, example.export(ExportFormat::Csv, options));
}

#[test]
fn what_cannot_be_exported_is_refused_in_one_line() {
    let folder = TempDir::new().unwrap();
    let (quadruped, biped) = (example_path("quadruped.urdf"), example_path("biped.urdf"));
    let refused: [(&Path, &[&str], &str); 5] = [
        (&quadruped, &["--format", "glb", "--fps", "1000.1"], "from 1 to 1000"),
        (&biped, &["--format", "glb"], "not for this character"),
        (&quadruped, &["--format", "csv", "--fps", "0"], "--fps: "),
        (&quadruped, &["--format", "csv", "--fps", "NaN"], "--fps: "),
        (&quadruped, &["--format", "ros", "--in-place"], "--in-place: "),
    ];
    for (character, arguments, reason) in refused {
        let arguments = [&["--character", character.to_str().unwrap()], arguments].concat();
        let path = folder.path().join("file");
        let output = run(&arguments, &path);
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert_eq!(message.trim_end().lines().count(), 1, "{message}");
        assert!(message.contains(reason), "{message}");
        assert!(!path.exists());
    }
    let unknown =
        run(&["--character", quadruped.to_str().unwrap(), "--format", "fbx"], &folder.path().join("f"));
    assert_eq!(unknown.status.code(), Some(2));
}
