//! The page's files: all of them come from the program, and they are few and small.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use super::client::Service;
use crate::common::repository;

/// Most bytes of a first load, without the viewer of recordings.
const FIRST_LOAD: usize = 300_000;

/// What a file refers to: `src`, `href` and module specifiers, as addresses.
fn references(address: &str, text: &str) -> Vec<String> {
    let marks = ["from \"", "from '", "import \"", "src=\"", "href=\""];
    let quoted = |mark: &&str| {
        text.split(mark).skip(1).filter_map(|rest| rest.split(['"', '\'']).next()).collect::<Vec<_>>()
    };
    let found = marks.iter().flat_map(quoted);
    found.filter(|name| name.starts_with(['.', '/'])).map(|name| resolved(address, name)).collect()
}

/// `name` as it is meant in the file at `address`.
fn resolved(address: &str, name: &str) -> String {
    if name.starts_with('/') {
        return name.to_owned();
    }
    let mut parts: Vec<&str> = address.split('/').collect();
    parts.pop();
    for part in name.split('/') {
        match part {
            "." => {}
            ".." => drop(parts.pop()),
            part => parts.push(part),
        }
    }
    parts.join("/")
}

/// Every file below `folder` with one of the endings.
fn files(folder: &Path, endings: &[&str], found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(&path, endings, found);
        } else if path.extension().is_some_and(|own| endings.iter().any(|ending| own == *ending)) {
            found.push(path);
        }
    }
}

#[test]
fn every_file_of_the_page_comes_from_the_program() {
    let service = Service::start();
    let (mut open, mut loaded) = (vec!["/".to_owned()], BTreeMap::new());
    while let Some(address) = open.pop() {
        if loaded.contains_key(&address) || address == "/openapi.json" {
            continue;
        }
        let answer = service.curl(&address, &[]);
        assert_eq!(answer.status, 200, "{address}");
        let wanted = match address.rsplit('.').next() {
            Some("js") => "text/javascript",
            Some("css") => "text/css",
            _ => "text/html",
        };
        assert!(
            answer.headers["content-type"].starts_with(wanted),
            "{address}: {}",
            answer.headers["content-type"]
        );
        let policy = &answer.headers["content-security-policy"];
        assert!(policy.contains("default-src 'self'"), "{policy}");
        assert!(
            policy.split(';').any(|part| part.trim() == "script-src 'self' 'wasm-unsafe-eval'"),
            "{policy}"
        );
        assert_eq!(answer.headers["x-content-type-options"], "nosniff");
        let tag = format!("if-none-match: {}", answer.headers["etag"]);
        assert_eq!(service.curl(&address, &["-H", &tag]).status, 304, "{address}");
        let text = answer.text();
        open.extend(references(&address, &text));
        loaded.insert(address, answer.body.len());
    }
    let bytes: usize = loaded.values().sum();
    assert!(bytes < FIRST_LOAD, "{bytes} bytes: {loaded:?}");

    // Nothing lies in the folder that is not loaded.
    let root = repository().join("static");
    let mut kept = Vec::new();
    files(&root, &["js", "css", "html"], &mut kept);
    let kept = kept.iter().map(|path| format!("/{}", path.strip_prefix(&root).unwrap().display()));
    let apart = ["/index.html", "/viewer.html", "/viewer.js"];
    let kept: BTreeSet<String> = kept.filter(|address| !apart.contains(&address.as_str())).collect();
    let served: BTreeSet<String> = loaded.into_keys().filter(|address| address != "/").collect();
    assert_eq!(kept, served);
}

#[test]
fn the_page_asks_nowhere_else() {
    let mut found = Vec::new();
    files(&repository().join("static"), &["js", "css", "html"], &mut found);
    found.retain(|path| !path.components().any(|part| part.as_os_str() == "vendor"));
    assert!(found.len() > 20);
    for path in found {
        // A namespace is a name and is not fetched.
        let text = fs::read_to_string(&path).unwrap().replace("http://www.w3.org/2000/svg", "");
        assert!(!text.contains("http://") && !text.contains("https://"), "{} asks elsewhere", path.display());
    }
}

#[test]
fn the_bundled_characters_come_from_the_program() {
    let service = Service::start();
    let text = fs::read_to_string(repository().join("static/modules/upload.js")).unwrap();
    let names = text.lines().filter_map(|line| line.trim().strip_prefix("[\"")?.split('"').next());
    let names: Vec<&str> = names.collect();
    assert!(names.len() >= 4, "{names:?}");
    for name in names {
        let answer = service.curl(&format!("/characters/{name}"), &[]);
        assert_eq!(answer.body, fs::read(repository().join("examples").join(name)).unwrap(), "{name}");
    }
}

#[test]
fn the_viewer_comes_from_the_program() {
    let service = Service::start();
    for (path, media_type) in [("/viewer/", "text/html"), ("/viewer/start.js", "text/javascript")] {
        let answer = service.curl(path, &[]);
        assert!(answer.headers["content-type"].starts_with(media_type), "{path}");
        assert!(answer.headers["content-security-policy"].contains("default-src 'self'"));
    }
    let program = service.curl("/viewer/re_viewer_bg.wasm", &[]);
    assert_eq!(program.headers["content-type"], "application/wasm");
    assert_eq!(&program.body[..4], b"\0asm");
    let tag = format!("if-none-match: {}", program.headers["etag"]);
    assert_eq!(service.curl("/viewer/re_viewer_bg.wasm", &["-H", &tag]).status, 304);
    assert_eq!(service.curl("/viewer/re_viewer.js", &[]).status, 200);
}
