//! Settings of the service: from flags, environment and file, and what is printed of them.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use tempfile::TempDir;

/// `serve --print-config` with further arguments and an environment of its own.
fn print(arguments: &[&str], environment: &[(&str, &str)]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gaitwright"));
    command.args(["serve", "--print-config"]).args(arguments).env_clear().envs(environment.iter().copied());
    command.output().unwrap()
}

fn printed(arguments: &[&str], environment: &[(&str, &str)]) -> toml::Table {
    let output = print(arguments, environment);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap().parse().unwrap()
}

/// The message with which settings are refused.
fn refused(arguments: &[&str], environment: &[(&str, &str)]) -> String {
    let output = print(arguments, environment);
    assert_eq!(output.status.code(), Some(2), "{}", String::from_utf8_lossy(&output.stdout));
    String::from_utf8(output.stderr).unwrap()
}

fn file(folder: &Path, text: &str) -> PathBuf {
    let path = folder.join("settings.toml");
    std::fs::write(&path, text).unwrap();
    path
}

fn integer(settings: &toml::Table, name: &str) -> i64 {
    settings[name].as_integer().unwrap()
}

#[test]
fn flags_come_before_the_environment_and_that_before_the_file() {
    let folder = TempDir::new().unwrap();
    let path = file(folder.path(), "queue = 10\nworkers = 2\nstreams = 30\n");
    let config = ["--config", path.to_str().unwrap()];
    let environment = [("GAITWRIGHT_WORKERS", "3"), ("GAITWRIGHT_STREAMS", "31")];
    let settings = printed(&[&config[..], &["--streams", "32"]].concat(), &environment);
    assert_eq!(integer(&settings, "queue"), 10);
    assert_eq!(integer(&settings, "workers"), 3);
    assert_eq!(integer(&settings, "streams"), 32);
    assert_eq!(settings["listen"].as_str(), Some("127.0.0.1:8080"));
    let by_variable = printed(&[], &[("GAITWRIGHT_CONFIG", path.to_str().unwrap())]);
    assert_eq!(integer(&by_variable, "queue"), 10);
}

#[test]
fn what_is_printed_is_a_settings_file() {
    let folder = TempDir::new().unwrap();
    let arguments =
        ["--listen", "0.0.0.0:1234", "--allow-host", "a", "--allow-host", "b", "--log-format", "json"];
    let environment =
        [("GAITWRIGHT_TOKEN", "secret-1"), ("GAITWRIGHT_TOKENS", "anna=secret-2,bert=secret-3=")];
    let first = print(&arguments, &environment).stdout;
    let text = String::from_utf8(first).unwrap();
    assert!(!text.contains("secret"), "{text}");
    let path = file(folder.path(), &text);
    let again = print(&["--config", path.to_str().unwrap()], &[]).stdout;
    assert_eq!(String::from_utf8(again).unwrap(), text);
    let settings: toml::Table = text.parse().unwrap();
    assert_eq!(settings["allow_host"].as_array().unwrap().len(), 2);
    let names: Vec<&String> = settings["tokens"].as_table().unwrap().keys().collect();
    assert_eq!(names, ["anna", "bert", "default"]);
}

#[test]
fn no_password_is_printed() {
    let files = ["--files", "file:///tmp/objects"];
    for store in [
        "postgres://anna:secret-1@host/jobs?sslmode=require",
        "postgres://anna@host/jobs?password=secret-1&sslmode=require",
    ] {
        for (arguments, environment) in [
            (&[&files[..], &["--store", store]].concat(), &[][..]),
            (&files.to_vec(), &[("GAITWRIGHT_STORE", store)]),
        ] {
            let settings = printed(arguments, environment);
            assert_eq!(settings["store"].as_str(), Some("postgres://anna@host/jobs?sslmode=require"));
        }
    }
    let folder = TempDir::new().unwrap();
    for store in
        ["mysql://anna:secret-1@host/jobs", "postgres://anna:secret-1@host:port/jobs", "://:secret-1@"]
    {
        let path = file(folder.path(), &format!("store = \"{store}\"\n"));
        for message in [
            refused(&["--store", store], &[]),
            refused(&[], &[("GAITWRIGHT_STORE", store)]),
            refused(&["--config", path.to_str().unwrap()], &[]),
        ] {
            assert!(
                message.contains("postgres://user@host/database") && !message.contains("secret"),
                "{message}"
            );
        }
    }
    let message = refused(&["--files", "s3://key:secret-1@bucket/prefix"], &[]);
    assert!(message.contains("s3://key@bucket/prefix") && !message.contains("secret"), "{message}");
}

#[test]
fn shares_follow_from_who_may_come() {
    let alone = printed(&[], &[]);
    assert_eq!(integer(&alone, "caller_queue"), integer(&alone, "queue"));
    assert_eq!(integer(&alone, "request_rate"), 0);
    let one = printed(&["--listen", "0.0.0.0:1"], &[("GAITWRIGHT_TOKEN", "secret")]);
    for places in ["streams", "simulations"] {
        assert_eq!(integer(&one, &format!("caller_{places}")), integer(&one, places));
    }
    assert!(integer(&one, "request_rate") > 0);
    for (arguments, environment) in
        [(&["--listen", "0.0.0.0:1", "--insecure"][..], &[][..]), (&[], &[("GAITWRIGHT_TOKENS", "a=1,b=2")])]
    {
        let several = printed(arguments, environment);
        assert_eq!(2 * integer(&several, "caller_queue"), integer(&several, "queue"));
        assert_eq!(2 * integer(&several, "caller_streams"), integer(&several, "streams"));
        // Of an odd number of cores, the larger half.
        let [share, all] = ["caller_simulations", "simulations"].map(|name| integer(&several, name));
        assert!((all..=all + 1).contains(&(2 * share)), "{share} of {all}");
    }
}

#[test]
fn what_is_no_setting_is_named() {
    let folder = TempDir::new().unwrap();
    let in_file = |text: &str| {
        let path = file(folder.path(), text);
        refused(&["--config", path.to_str().unwrap()], &[])
    };
    let message = in_file("queue = 1\nworkerz = 2\n");
    assert!(message.contains("settings.toml: line 2") && message.contains("`workerz`"), "{message}");
    let message = in_file("queue = 1\n\nworkers = \"two\"\n");
    assert!(message.contains("line 3"), "{message}");
    let message = in_file("queue = ");
    assert!(message.contains("line 1"), "{message}");
    let message = in_file("[tokens]\n\"two words\" = \"secret\"\n");
    assert!(message.contains("name"), "{message}");
    let message = in_file("[tokens]\nanna = \"\"\n");
    assert!(message.contains("empty"), "{message}");
    let message = refused(&[], &[("GAITWRIGHT_WORKER", "2")]);
    assert!(message.contains("GAITWRIGHT_WORKER:"), "{message}");
    let message = refused(&["--config", "/nowhere/settings.toml"], &[]);
    assert!(message.contains("/nowhere/settings.toml"), "{message}");
    assert!(refused(&[], &[("GAITWRIGHT_TOKENS", "anna")]).contains("name=token"));
    assert!(refused(&[], &[("GAITWRIGHT_TOKENS", "anna=1,anna=2")]).contains("twice"));
    assert!(refused(&[], &[("GAITWRIGHT_TOKEN", "two words")]).contains("GAITWRIGHT_TOKEN"));
    assert!(refused(&["--workers", "300"], &[]).contains("workers"));
    assert!(refused(&["--listen", "0.0.0.0:1"], &[]).contains("--insecure"));
}
