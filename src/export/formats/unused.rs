//! Names for what a format needs beside the character.

/// `name`, or with as many underscores after it as it takes for nobody to have it already.
pub fn unused(name: &str, taken: impl Fn(&str) -> bool) -> String {
    let mut name = name.to_owned();
    while taken(&name) {
        name.push('_');
    }
    name
}
