//! Writes values of the command line into the text of a scenario.

use bittybuzz_arena::sweep::KeyNames;
use toml_edit::{DocumentMut, Item, Table, TableLike, Value};

/// Returns the text with some values (`medium.ir.loss=0.1`) replaced or added. The rest stays as it
/// is, including comments. The error is the value that has no place in the text.
pub fn put_all<'a>(text: &str, values: impl Iterator<Item = &'a str>) -> Result<String, String> {
    let mut values = values.peekable();
    let Some(first) = values.peek() else { return Ok(text.to_owned()) };
    // Another reader has accepted the text as a scenario. Should this one not do so, nothing has a
    // place in the text.
    let mut document: DocumentMut = text.parse().map_err(|_| (*first).to_owned())?;
    let names = KeyNames::of(text);
    for one in values {
        let (key, value) = one.split_once('=').ok_or(one)?;
        let key = names.indexed(key.trim()).map_err(|_| one)?;
        let value = value.trim();
        // Words need no quotes, as in `--set` itself.
        let value = value.parse().unwrap_or_else(|_| Value::from(value));
        put(document.as_table_mut(), &key, value).ok_or(one)?;
    }
    Ok(document.to_string())
}

/// Puts a value at a path below a table. Returns `None` if there is no such place.
fn put(parent: &mut dyn TableLike, path: &str, mut value: Value) -> Option<()> {
    let Some((word, rest)) = path.split_once('.') else {
        if let Some(old) = parent.get(path).and_then(Item::as_value) {
            // The comment after the old value stays.
            *value.decor_mut() = old.decor().clone();
        }
        parent.insert(path, Item::Value(value));
        return Some(());
    };
    match parent.entry(word).or_insert_with(|| Item::Table(implicit())) {
        Item::ArrayOfTables(tables) => {
            let (index, rest) = rest.split_once('.')?;
            put(tables.get_mut(index.parse().ok()?)?, rest, value)
        }
        Item::Value(Value::Array(tables)) => {
            let (index, rest) = rest.split_once('.')?;
            put(tables.get_mut(index.parse().ok()?)?.as_inline_table_mut()?, rest, value)
        }
        other => put(other.as_table_like_mut()?, rest, value),
    }
}

/// Returns a table that has no header line while it has no value.
fn implicit() -> Table {
    let mut table = Table::new();
    table.set_implicit(true);
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use bittybuzz_arena::scenario::Scenario;
    use bittybuzz_compiler::include::MemoryFiles;
    use std::path::Path;

    const TEXT: &str = "\
# A small swarm.
[world]
size = [800, 600] # millimeters
duration = 60
obstacles = [{ at = [300, 200], radius = 20 }]

[medium.ir]
loss = 0.1   # of ten frames one

[[robots]]
robot = \"kilobot\"
script = \"s.bzz\"
count = 2

# The last.
[[robots]]
robot = \"kilobot\"
script = \"t.bzz\"
";

    /// The meaning of a text with some values, without the numbers of its lines.
    fn meaning(text: &str, set: &[String]) -> String {
        let models = bittybuzz_robot_models::all();
        let scripts = ["s.bzz", "t.bzz", "u.bzz"];
        let files =
            scripts.into_iter().fold(MemoryFiles::default(), |files, name| files.with(name, ""));
        let read = Scenario::parse_in(&files, text, Path::new("s.toml"), set, &models).unwrap();
        let groups: Vec<_> = read.groups.iter().map(|group| (group.count, &group.script)).collect();
        format!("{:?}", (&read.world, &read.models, &read.media, read.output.every, groups))
    }

    #[test]
    fn the_text_has_the_values_and_its_comments() {
        let sets =
            ["medium.ir.loss=0.5", "world.seed=7", "robots.1.script=u.bzz", "body.kilobot.speed=9"];
        let expected = TEXT
            .replace("loss = 0.1   # of", "loss = 0.5   # of")
            .replace("20 }]\n", "20 }]\nseed = 7\n")
            .replace("\"t.bzz\"", "\"u.bzz\"")
            + "\n[body.kilobot]\nspeed = 9\n";
        assert_eq!(put_all(TEXT, sets.into_iter()).unwrap(), expected);
        assert_eq!(put_all(TEXT, [].into_iter()).unwrap(), TEXT);
    }

    #[test]
    fn the_text_means_the_same_as_the_values() {
        for set in [
            "world.seed=4294967295",
            "world.size=[900, 900]",
            "world.obstacles.0.radius=30",
            "world.ambient = 25",
            "robots.0.count=40",
            "robots.kilobot-2.count=3",
            "robots.1.script=u.bzz",
            "robots.1.script=\"u.bzz\"",
            "body.kilobot.speed_error=0",
            "medium.ir.loss=0",
            "medium.ir.rate=5",
            "output.every=2",
        ] {
            let sets = [set.to_owned()];
            let text = put_all(TEXT, [set].into_iter()).unwrap();
            assert_eq!(meaning(&text, &[]), meaning(TEXT, &sets), "{set}:\n{text}");
            assert_ne!(meaning(&text, &[]), meaning(TEXT, &[]), "{set}");
        }
    }

    #[test]
    fn a_value_without_a_place_is_an_error() {
        for set in ["robots.9.count=1", "robots.x.count=1", "world.size.x=1", "robots.0=1", "x"] {
            assert_eq!(put_all(TEXT, [set].into_iter()), Err(set.to_owned()));
        }
        let damaged = put_all("[world", ["world.seed=7"].into_iter());
        assert_eq!(damaged, Err("world.seed=7".to_owned()));
    }
}
