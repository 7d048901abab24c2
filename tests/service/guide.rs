//! The shell commands in README and in the guide.
//!
//! A block ```` ```sh ```` is run: those of one document one after the other, by one shell, in a folder of their own that
//! holds the examples. A block ```` ```sh,long ```` would take too long, or needs what a clone does not have: of it
//! every command is only looked up. Wherever a document says `cargo run --release --`, the program under test is
//! run, and port 8080 is replaced by a free one.

use std::collections::HashMap;
use std::fs;
use std::net::TcpListener;
use std::path::PathBuf;
use std::process::{Command, Output};

use tempfile::TempDir;

use crate::common::repository;

/// The program under test.
const PROGRAM: &str = env!("CARGO_BIN_EXE_gaitwright");

/// Longest time that the blocks of one document may take, s.
const LONGEST: &str = "120";

/// Programs that a block may call although no clone has them.
const OTHERS: [&str; 9] = ["cd", "cp", "curl", "git", "kill", "mkdir", "pip", "python", "rerun"];

/// What runs before the blocks: the first command that fails ends the shell and is named, an answer of the service that is
/// an error counts as a failure, and what was started in the background is ended.
const PROLOGUE: &str = r#"set -Eeuo pipefail
trap 'echo "failed: $BASH_COMMAND" >&2' ERR
trap 'kill $(jobs -p) 2>/dev/null || true' EXIT
curl() { command curl --fail "$@"; }
"#;

/// A block of shell commands.
struct Block {
    /// Whether it is only looked at.
    long: bool,
    text: String,
}

/// The shell blocks of a Markdown text.
fn blocks(markdown: &str) -> Vec<Block> {
    let mut found: Vec<Block> = Vec::new();
    let mut fence: Option<bool> = None;
    for line in markdown.lines() {
        match (line.strip_prefix("```"), fence) {
            (Some(_), Some(_)) => fence = None,
            (Some(info), None) => {
                let shell = info == "sh" || info == "sh,long";
                assert!(shell || !info.starts_with("sh"), "no such mark of a shell block: {info}");
                fence = Some(shell);
                if shell {
                    found.push(Block { long: info == "sh,long", text: String::new() });
                }
            }
            (None, Some(true)) => {
                let block = found.last_mut().expect("an open block");
                block.text.push_str(line);
                block.text.push('\n');
            }
            (None, _) => {}
        }
    }
    found
}

/// README and the pages of the guide.
fn documents() -> Vec<PathBuf> {
    let pages = fs::read_dir(repository().join("src/guide")).unwrap().map(|entry| entry.unwrap().path());
    let mut pages: Vec<_> = pages.filter(|path| path.extension().is_some_and(|end| end == "md")).collect();
    pages.sort();
    pages.insert(0, repository().join("README.md"));
    pages
}

/// The script of the blocks that are run; `None` without any.
fn script(blocks: &[Block]) -> Option<String> {
    let text: String = blocks.iter().filter(|block| !block.long).map(|block| block.text.as_str()).collect();
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let text = text.replace("cargo run --release -- ", "gaitwright ").replace("8080", &port.to_string());
    (!text.is_empty()).then(|| format!("{PROLOGUE}{text}"))
}

/// Runs `script` in a folder that holds the examples.
fn run(script: &str) -> Output {
    let folder = TempDir::new().unwrap();
    let examples = folder.path().join("examples");
    for folder in ["", "python"] {
        let examples = examples.join(folder);
        fs::create_dir(&examples).unwrap();
        for entry in fs::read_dir(repository().join("examples").join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path.is_file() {
                fs::copy(&path, examples.join(path.file_name().unwrap())).unwrap();
            }
        }
    }
    let programs = folder.path().join("bin");
    fs::create_dir(&programs).unwrap();
    std::os::unix::fs::symlink(PROGRAM, programs.join("gaitwright")).unwrap();
    let path = format!("{}:{}", programs.display(), std::env::var("PATH").unwrap_or_default());
    let blocks = folder.path().join("blocks.sh");
    fs::write(&blocks, script).unwrap();
    let mut shell = Command::new("timeout");
    shell.args(["--kill-after=5", LONGEST, "bash"]).arg(&blocks).env("PATH", path).current_dir(folder.path());
    shell.output().unwrap()
}

/// The commands of a text, each as its words: without comments, continued lines joined, split where one command ends and
/// the next begins.
fn commands(text: &str) -> Vec<Vec<String>> {
    let mut commands = Vec::new();
    for line in text.replace("\\\n", " ").lines() {
        let (mut words, mut word, mut quote) = (Vec::new(), String::new(), None);
        for letter in line.chars().chain([' ']) {
            match quote {
                Some(mark) if letter == mark => quote = None,
                Some(_) => word.push(letter),
                None if letter == '#' && word.is_empty() => break,
                None => match letter {
                    '\'' | '"' => quote = Some(letter),
                    ' ' | '|' | ';' | '&' => {
                        if !word.is_empty() {
                            words.push(std::mem::take(&mut word));
                        }
                        if letter != ' ' && !words.is_empty() {
                            commands.push(std::mem::take(&mut words));
                        }
                    }
                    _ => word.push(letter),
                },
            }
        }
        if !words.is_empty() {
            commands.push(words);
        }
    }
    commands
}

/// What is wrong with a command, as far as this shows without running it.
fn fault(words: &[String], help: &mut HashMap<String, Option<String>>) -> Option<String> {
    // Variables may stand before a command.
    let start = words.iter().position(|word| !word.contains('=') || word.starts_with('-'))?;
    let words: Vec<&str> = words[start..].iter().map(String::as_str).collect();
    let absent = |path: String| (!repository().join(&path).exists()).then(|| format!("there is no {path}"));
    let after = |flag: &str| {
        let at = words.iter().position(|word| *word == flag)?;
        words.get(at + 1).copied()
    };
    match words.as_slice() {
        ["gaitwright" | "target/release/gaitwright", command, arguments @ ..]
        | ["cargo", "run", "--release", "--", command, arguments @ ..] => {
            let help = help.entry((*command).to_owned()).or_insert_with(|| {
                let output = Command::new(PROGRAM).args([command, "--help"]).output().unwrap();
                output.status.success().then(|| String::from_utf8(output.stdout).unwrap())
            });
            let Some(help) = help else { return Some(format!("there is no command {command}")) };
            let known = |flag: &str| help.split([' ', '\n', ',']).any(|word| word == flag);
            let flags = arguments.iter().filter(|argument| argument.starts_with("--"));
            let unknown: Vec<&&str> = flags.filter(|flag| !known(flag)).collect();
            (!unknown.is_empty()).then(|| format!("{command} has no {unknown:?}"))
        }
        ["cargo", ..] => {
            let member = |name: &str| {
                absent(match name {
                    "gaitwright" => "src/lib.rs".to_owned(),
                    name => format!("src/{}/lib.rs", name.trim_start_matches("gaitwright-")),
                })
            };
            [
                after("--bench").and_then(|name| absent(format!("benches/{name}.rs"))),
                after("--example").and_then(|name| absent(format!("examples/{name}.rs"))),
                after("--test").and_then(|name| absent(format!("tests/{name}/main.rs"))),
                after("-p").and_then(member),
            ]
            .into_iter()
            .flatten()
            .next()
        }
        ["python", path, ..] => absent((*path).to_owned()),
        [path, ..] if path.starts_with(".ci/") => absent((*path).to_owned()),
        [other, ..] if OTHERS.contains(other) => None,
        other => Some(format!("no command that a reader could run: {other:?}")),
    }
}

#[test]
fn commands_in_the_documents_exist() {
    let mut help = HashMap::new();
    for path in documents() {
        for block in blocks(&fs::read_to_string(&path).unwrap()).iter().filter(|block| block.long) {
            for words in commands(&block.text) {
                if let Some(fault) = fault(&words, &mut help) {
                    panic!("{}: `{}`: {fault}", path.display(), words.join(" "));
                }
            }
        }
    }
}

#[test]
fn commands_in_the_documents_work() {
    let run = |path: PathBuf| {
        std::thread::spawn(move || {
            let script = script(&blocks(&fs::read_to_string(&path).unwrap()))?;
            let output = run(&script);
            let (said, told) =
                (String::from_utf8_lossy(&output.stderr), String::from_utf8_lossy(&output.stdout));
            (!output.status.success())
                .then(|| format!("{}: {}\n{said}\n{told}", path.display(), output.status))
        })
    };
    let running: Vec<_> = documents().into_iter().map(run).collect();
    let failed: Vec<String> = running.into_iter().filter_map(|one| one.join().unwrap()).collect();
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

#[test]
fn a_command_that_does_not_exist_is_found() {
    let fault_of = |line: &str| fault(&commands(line)[0], &mut HashMap::new());
    assert_eq!(fault_of("gaitwright check robot.urdf --strict  # a comment"), None);
    assert_eq!(fault_of("ROBOT=a1.urdf cargo bench --bench step"), None);
    for line in [
        "gaitwright walk robot.urdf",
        "cargo run --release -- train robot.urdf --outt walk",
        "cargo bench --bench no-such-bench",
        "cargo run --release -p gaitwright-physiks --example step",
        "no-such-program",
    ] {
        assert!(fault_of(line).is_some(), "{line}");
    }
    let broken = blocks("```sh\ngaitwright check examples/biped.urdf > check.json\ngaitwright walk\n```\n");
    let output = run(&script(&broken).unwrap());
    assert!(!output.status.success());
    assert!(String::from_utf8_lossy(&output.stderr).contains("failed: "));
}
