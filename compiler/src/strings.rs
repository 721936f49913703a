//! The numbering of strings.
//!
//! Robots send string numbers to each other, so all images that are built from one source must
//! agree on the numbers. The machine's own strings come first, then all strings of the source, used
//! or not, sorted by their bytes.

use std::collections::BTreeSet;

use bittybuzz_vm_core::builtin;

/// The strings of a script and their numbers.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct StringTable {
    /// The strings that are not the machine's own: those of the source, sorted, then those that were
    /// added.
    script: Vec<String>,
    /// The number of strings of the source.
    sorted: usize,
}

impl StringTable {
    /// Numbers the strings of a script, which may be in any order and occur several times.
    pub fn new<'a>(strings: impl IntoIterator<Item = &'a str>) -> Self {
        let unique: BTreeSet<&str> =
            strings.into_iter().filter(|s| own_number(s).is_none()).collect();
        let script: Vec<String> = unique.into_iter().map(str::to_owned).collect();
        StringTable { sorted: script.len(), script }
    }

    /// Returns the number of a string. A string that is not in the table is added after all others.
    pub fn number_or_add(&mut self, text: &str) -> usize {
        self.number(text).unwrap_or_else(|| {
            self.script.push(text.to_owned());
            usize::from(builtin::string::COUNT) + self.script.len() - 1
        })
    }

    /// Returns the strings that are not the machine's own, in the order of their numbers.
    pub fn script(&self) -> &[String] {
        &self.script
    }

    /// Returns the number of a string; `None` if it is not in the table. A table with more strings
    /// than an image can count has greater numbers than fit.
    pub fn number(&self, text: &str) -> Option<usize> {
        if let Some(number) = own_number(text) {
            return Some(number);
        }
        let (sorted, added) = self.script.split_at(self.sorted);
        let index = match sorted.binary_search_by(|s| s.as_str().cmp(text)) {
            Ok(index) => index,
            Err(_) => self.sorted + added.iter().position(|s| s == text)?,
        };
        Some(usize::from(builtin::string::COUNT) + index)
    }

    /// Returns for every string of the script the number of the machine's own strings that sort
    /// before it.
    pub fn order(&self) -> impl Iterator<Item = u8> {
        let before = |text: &str| builtin::STRINGS.iter().filter(|own| **own < text).count();
        self.script.iter().map(move |text| before(text) as u8)
    }
}

/// Returns the number of one of the machine's own strings; `None` for other strings.
pub fn own_number(text: &str) -> Option<usize> {
    builtin::STRINGS.binary_search(&text).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn own_strings_keep_their_numbers_and_are_not_repeated() {
        let table = StringTable::new(["robot", "zebra", "distance", "apple", "zebra"]);
        assert_eq!(table.script(), ["apple", "zebra"]);
        assert_eq!(table.number("robot"), Some(builtin::string::ROBOT.into()));
        assert_eq!(table.number("apple"), Some(builtin::string::COUNT.into()));
        assert_eq!(table.number("zebra"), Some(usize::from(builtin::string::COUNT) + 1));
        assert_eq!(table.number("absent"), None);
    }

    #[test]
    fn order_counts_own_strings_before() {
        let table = StringTable::new(["", "azimuth2", "zzz", "nim"]);
        let order: Vec<u8> = table.order().collect();
        // "" < azimuth < azimuth2 < closure ... integer < nil < nim < robot ... < timestamp < zzz
        assert_eq!(order, [0, 1, 8, 12]);
    }

    #[test]
    fn bytes_decide_not_letters() {
        let table = StringTable::new(["b", "a", "Z", "\u{e9}"]);
        assert_eq!(table.script(), ["Z", "a", "b", "\u{e9}"]);
    }
}
