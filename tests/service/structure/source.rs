//! Source files as modules, and which of them names something from which other.
//!
//! Paths are read from `use` declarations and from the code itself, and followed through re-exports to the file
//! that defines the name. A re-export alone is no import: it only hands the name on.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// A module's path from the root of its crate: `["sim", "step"]`; empty for the root itself.
pub type ModulePath = Vec<String>;

/// The modules of one crate.
pub struct Modules {
    files: BTreeMap<ModulePath, SourceFile>,
}

struct SourceFile {
    path: PathBuf,
    /// Every path in the code, the `use` declarations' own included.
    paths: BTreeSet<Vec<String>>,
    /// What a name stands for here by a `use` declaration.
    imports: BTreeMap<String, Vec<String>>,
    /// Names handed on by `pub use`, and paths of which all names are.
    exports: BTreeMap<String, Vec<String>>,
    export_all: Vec<Vec<String>>,
}

impl Modules {
    /// The crate whose root file is `root` and whose modules stand beside it. `rooms` are the root's modules.
    pub fn read(root: &Path, rooms: &[&str]) -> Self {
        let folder = root.parent().unwrap();
        let mut files = BTreeMap::from([(Vec::new(), SourceFile::read(root))]);
        for room in rooms {
            let single = folder.join(format!("{room}.rs"));
            for path in if single.is_file() { vec![single] } else { rust_files(&folder.join(room)) } {
                let relative = path.strip_prefix(folder).unwrap().with_extension("");
                let mut module: ModulePath =
                    relative.iter().map(|name| name.to_str().unwrap().to_owned()).collect();
                module.pop_if(|name| name == "mod");
                files.insert(module, SourceFile::read(&path));
            }
        }
        Self { files }
    }

    /// The files of the module `prefix` and below.
    pub fn files(&self, prefix: &[&str]) -> Vec<(&ModulePath, &Path)> {
        let below = |module: &ModulePath| {
            prefix.iter().enumerate().all(|(at, name)| module.get(at).is_some_and(|own| own == name))
        };
        let files = self.files.iter().filter(|(module, _)| below(module));
        files.map(|(module, file)| (module, &*file.path)).collect()
    }

    /// The modules of this crate that the code of `module` takes a name from, itself left out.
    pub fn imports(&self, module: &ModulePath) -> BTreeSet<ModulePath> {
        let file = &self.files[module];
        let mut found = BTreeSet::new();
        for path in &file.paths {
            if let Some(absolute) = self.absolute(module, path)
                && let Some(defining) = self.defining(&absolute, 0)
                && defining != *module
            {
                found.insert(defining);
            }
        }
        found
    }

    /// Whether the code of `module` has a path that begins with the names of `prefix`.
    pub fn names(&self, module: &ModulePath, prefix: &str) -> bool {
        let begins = |path: &Vec<String>| {
            prefix.split("::").enumerate().all(|(at, name)| path.get(at).is_some_and(|own| own == name))
        };
        self.files[module].paths.iter().any(begins)
    }

    /// Groups of modules that reach each other by their imports.
    pub fn circles(&self) -> BTreeSet<BTreeSet<ModulePath>> {
        let direct: BTreeMap<_, _> = self.files.keys().map(|module| (module, self.imports(module))).collect();
        let reach = |from: &ModulePath| {
            let mut found = BTreeSet::new();
            let mut open: Vec<&ModulePath> = direct[from].iter().collect();
            while let Some(next) = open.pop() {
                if found.insert(next.clone()) {
                    open.extend(&direct[next]);
                }
            }
            found
        };
        let reached: BTreeMap<_, _> = self.files.keys().map(|module| (module, reach(module))).collect();
        let mut circles = BTreeSet::new();
        for (module, others) in &reached {
            if others.contains(*module) {
                let ring: BTreeSet<ModulePath> =
                    others.iter().filter(|other| reached[other].contains(*module)).cloned().collect();
                circles.insert(ring);
            }
        }
        circles
    }

    /// `path` as it is written in `module`, from the root of the crate; `None` if it leads elsewhere.
    fn absolute(&self, module: &ModulePath, path: &[String]) -> Option<Vec<String>> {
        let (first, rest) = path.split_first()?;
        let mut base = match first.as_str() {
            "crate" => Vec::new(),
            "self" => module.clone(),
            "super" => module[..module.len().checked_sub(1)?].to_vec(),
            name => {
                let child = [module.as_slice(), &[name.to_owned()]].concat();
                if self.files.contains_key(&child) {
                    child
                } else {
                    let imported = self.files[module].imports.get(name)?;
                    if imported[0] == *name {
                        return None;
                    }
                    self.absolute(module, imported)?
                }
            }
        };
        for name in rest {
            if name == "super" {
                base.pop()?;
            } else {
                base.push(name.clone());
            }
        }
        Some(base)
    }

    /// The module that defines what `absolute` names; `None` if that is a module as a whole.
    fn defining(&self, absolute: &[String], depth: usize) -> Option<ModulePath> {
        assert!(depth < 20, "re-exports lead in a circle at {absolute:?}");
        let mut module = ModulePath::new();
        for (index, name) in absolute.iter().enumerate() {
            module.push(name.clone());
            if self.files.contains_key(&module) {
                continue;
            }
            module.pop();
            let file = &self.files[&module];
            let handed_on = file.exports.get(name).cloned().into_iter().chain(
                file.export_all.iter().map(|path| [path.as_slice(), std::slice::from_ref(name)].concat()),
            );
            for path in handed_on {
                if let Some(target) = self.absolute(&module, &path) {
                    let further = [&target, &absolute[index + 1..]].concat();
                    return self.defining(&further, depth + 1);
                }
            }
            return Some(module);
        }
        None
    }
}

impl SourceFile {
    fn read(path: &Path) -> Self {
        let words =
            words(&fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display())));
        let mut file = Self {
            path: path.to_owned(),
            paths: BTreeSet::new(),
            imports: BTreeMap::new(),
            exports: BTreeMap::new(),
            export_all: Vec::new(),
        };
        let mut at = 0;
        while at < words.len() {
            if words[at] == "use" {
                let public = at > 0 && (words[at - 1] == "pub" || words[at - 1] == ")");
                let end = at + words[at..].iter().position(|word| word == ";").unwrap();
                let mut names = Vec::new();
                expand(&words[at + 1..end], &mut Vec::new(), &mut names);
                for (name, path) in names {
                    match (public, name.as_str()) {
                        (true, "*") => file.export_all.push(path),
                        (true, _) => drop(file.exports.insert(name, path)),
                        (false, _) => {
                            file.paths.insert(path.clone());
                            file.imports.insert(name, path);
                        }
                    }
                }
                at = end;
            } else if is_name(&words[at]) && (at == 0 || words[at - 1] != "::") {
                let mut path = vec![words[at].clone()];
                while words.get(at + 1).is_some_and(|word| word == "::")
                    && words.get(at + 2).is_some_and(|word| is_name(word))
                {
                    path.push(words[at + 2].clone());
                    at += 2;
                }
                if path.len() > 1 {
                    file.paths.insert(path);
                }
            }
            at += 1;
        }
        file
    }
}

/// The names that a tree of a `use` declaration brings, each with its path.
fn expand(tree: &[String], prefix: &mut Vec<String>, names: &mut Vec<(String, Vec<String>)>) {
    let depth = prefix.len();
    let mut at = 0;
    while at < tree.len() {
        match tree[at].as_str() {
            "::" => {}
            "{" => {
                let mut start = at + 1;
                let mut level = 0;
                for (index, word) in tree.iter().enumerate().skip(at) {
                    match word.as_str() {
                        "{" => level += 1,
                        "}" => level -= 1,
                        _ => {}
                    }
                    if level == 0 || (level == 1 && word == ",") {
                        expand(&tree[start..index], prefix, names);
                        start = index + 1;
                    }
                    if level == 0 {
                        break;
                    }
                }
                prefix.truncate(depth);
                return;
            }
            "as" => {
                names.push((tree[at + 1].clone(), prefix.clone()));
                prefix.truncate(depth);
                return;
            }
            "*" => {
                names.push(("*".to_owned(), prefix.clone()));
                prefix.truncate(depth);
                return;
            }
            "self" if !prefix.is_empty() => {}
            name => prefix.push(name.to_owned()),
        }
        at += 1;
    }
    if let Some(name) = prefix.last().filter(|_| prefix.len() > depth || tree == ["self"]) {
        names.push((name.clone(), prefix.clone()));
    }
    prefix.truncate(depth);
}

fn is_name(word: &str) -> bool {
    word.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// Names, `::` and single signs of Rust source, without comments and the contents of strings.
fn words(text: &str) -> Vec<String> {
    let mut words = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let length = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if let Some(raw) = rest.strip_prefix("r#\"") {
            3 + raw.find("\"#").map_or(raw.len(), |end| end + 2)
        } else if first == '"' {
            let mut escaped = false;
            let end = rest[1..].char_indices().find(|(_, c)| {
                let ends = *c == '"' && !escaped;
                escaped = *c == '\\' && !escaped;
                ends
            });
            end.map_or(rest.len(), |(index, _)| index + 2)
        } else if let Some(character) =
            ["'\"'", "'\\\"'", "'\\''"].iter().find(|quoted| rest.starts_with(**quoted))
        {
            character.len()
        } else if first.is_alphanumeric() || first == '_' {
            let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
            words.push(rest[..end].to_owned());
            end
        } else if rest.starts_with("::") {
            words.push("::".to_owned());
            2
        } else {
            if !first.is_whitespace() {
                words.push(first.to_string());
            }
            first.len_utf8()
        };
        rest = &rest[length..];
    }
    words
}

/// The Rust files in `folder` and below, in order.
pub fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![folder.to_owned()];
    while let Some(path) = open.pop() {
        if path.is_dir() {
            open.extend(fs::read_dir(&path).unwrap().map(|entry| entry.unwrap().path()));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
    found.sort();
    found
}

#[test]
fn declarations_are_expanded() {
    let text =
        "use crate::{a::{B, self}, c::D as E, f::*}; use g; // use crate::h::I;\nlet x = \"use j::K;\";";
    let words = words(text);
    let mut names = Vec::new();
    for declaration in
        words.split(|word| word == ";").filter(|words| words.first().is_some_and(|word| word == "use"))
    {
        expand(&declaration[1..], &mut Vec::new(), &mut names);
    }
    let names: Vec<(&str, String)> =
        names.iter().map(|(name, path)| (name.as_str(), path.join("::"))).collect();
    let expected =
        [("B", "crate::a::B"), ("a", "crate::a"), ("E", "crate::c::D"), ("*", "crate::f"), ("g", "g")];
    assert_eq!(names, expected.map(|(name, path)| (name, path.to_owned())));
}

#[test]
fn imports_are_followed_through_re_exports() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    };
    write("lib.rs", "pub mod room;\npub use room::Thing;\n");
    write("room/mod.rs", "mod inner;\nmod user;\npub use inner::Thing;\npub struct Own;\n");
    write("room/inner.rs", "pub struct Thing;\nimpl Thing { fn f() { super::user::help(); } }\n");
    write(
        "room/user.rs",
        "use crate::Thing;\nuse super::Own;\nuse super::inner;\npub fn help() { inner::Thing; }\n",
    );
    let modules = Modules::read(&folder.path().join("lib.rs"), &["room"]);
    let path = |text: &str| -> ModulePath { text.split("::").map(str::to_owned).collect() };
    assert_eq!(modules.imports(&path("room::user")), BTreeSet::from([path("room"), path("room::inner")]));
    assert_eq!(modules.imports(&path("room")), BTreeSet::new());
    let circle = BTreeSet::from([path("room::inner"), path("room::user")]);
    assert_eq!(modules.circles(), BTreeSet::from([circle]));
}
