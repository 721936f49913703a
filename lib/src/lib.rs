//! The Buzz library as constants, so that `include "vec2.bzz"` works wherever a program with the compiler runs: without files, in a
//! web page too. The texts take 12 kB.

#![no_std]

macro_rules! library {
    ($($name:literal),*) => { &[$(($name, include_str!(concat!("../", $name)))),*] };
}

/// File name and text of every file of the library.
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
    fn no_file_is_left_out() {
        let on_disk: BTreeSet<String> = fs::read_dir(env!("CARGO_MANIFEST_DIR"))
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .filter(|name| name.ends_with(".bzz"))
            .collect();
        let embedded: BTreeSet<String> = FILES.iter().map(|(name, _)| (*name).to_owned()).collect();
        assert_eq!(embedded, on_disk);
    }
}
