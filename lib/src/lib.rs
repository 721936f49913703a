//! The files of the Buzz library as constants. `include "vec2.bzz"` therefore works in every
//! program with the compiler, even without files, such as in a web page. The texts take 12 kB.

#![no_std]

macro_rules! library {
    ($($name:literal),*) => { &[$(($name, include_str!(concat!("../", $name)))),*] };
}

/// The name and the text of every file of the library.
pub const FILES: &[(&str, &str)] = library![
    "arrows.bzz",
    "matrix.bzz",
    "neighbors.bzz",
    "queue.bzz",
    "string.bzz",
    "table.bzz",
    "vec2.bzz"
];

#[cfg(test)]
mod tests {
    extern crate std;

    use super::FILES;
    use std::borrow::ToOwned;
    use std::collections::BTreeSet;
    use std::fs;
    use std::string::String;

    #[test]
    fn every_library_file_is_included() {
        let on_disk: BTreeSet<String> = fs::read_dir(env!("CARGO_MANIFEST_DIR"))
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .filter(|name| name.ends_with(".bzz"))
            .collect();
        let embedded: BTreeSet<String> = FILES.iter().map(|(name, _)| (*name).to_owned()).collect();
        assert_eq!(embedded, on_disk);
    }
}
