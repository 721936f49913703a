//! The Buzz library, embedded, so that `include "vec2.bzz"` works wherever bbz is installed.

macro_rules! library {
    ($($name:literal),*) => { &[$(($name, include_str!(concat!("../../lib/", $name)))),*] };
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
    use super::FILES;
    use std::collections::BTreeSet;
    use std::fs;
    use std::path::Path;

    #[test]
    fn no_file_is_left_out() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../lib");
        let on_disk: BTreeSet<String> = fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .filter(|name| name.ends_with(".bzz"))
            .collect();
        let embedded: BTreeSet<String> = FILES.iter().map(|(name, _)| (*name).to_owned()).collect();
        assert_eq!(embedded, on_disk);
    }
}
