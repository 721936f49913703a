//! Showing what differs between two texts.

/// The lines of both texts, `-` before those that are missing and `+` before those that are too many;
/// `None` if the texts are equal.
///
/// The two texts are a few lines of output, so a longest common subsequence by table is fast enough.
pub fn lines(expected: &[&str], actual: &[&str]) -> Option<String> {
    if expected == actual {
        return None;
    }
    // common[i][j]: length of the longest common subsequence of expected[i..] and actual[j..]
    let mut common = vec![vec![0_usize; actual.len() + 1]; expected.len() + 1];
    for (i, e) in expected.iter().enumerate().rev() {
        for (j, a) in actual.iter().enumerate().rev() {
            common[i][j] = if e == a {
                common[i + 1][j + 1] + 1
            } else {
                common[i + 1][j].max(common[i][j + 1])
            };
        }
    }
    let mut text = String::new();
    let (mut i, mut j) = (0, 0);
    while i < expected.len() || j < actual.len() {
        let (mark, line) = if i < expected.len() && j < actual.len() && expected[i] == actual[j] {
            i += 1;
            j += 1;
            (' ', expected[i - 1])
        } else if i < expected.len() && (j == actual.len() || common[i + 1][j] >= common[i][j + 1])
        {
            i += 1;
            ('-', expected[i - 1])
        } else {
            j += 1;
            ('+', actual[j - 1])
        };
        text.push_str(&format!("    {mark} {line}\n"));
    }
    Some(text)
}

#[cfg(test)]
mod tests {
    use super::lines;

    #[test]
    fn equal_texts_do_not_differ() {
        assert_eq!(lines(&[], &[]), None);
        assert_eq!(lines(&["a", "b"], &["a", "b"]), None);
    }

    #[test]
    fn missing_and_surplus_lines_are_marked() {
        let diff = lines(&["a", "b", "c"], &["a", "x", "c", "d"]).unwrap();
        assert_eq!(diff, "      a\n    - b\n    + x\n      c\n    + d\n");
    }

    #[test]
    fn a_blank_at_the_end_counts() {
        assert!(lines(&["a"], &["a "]).is_some());
        assert!(lines(&[""], &[]).is_some());
    }
}
