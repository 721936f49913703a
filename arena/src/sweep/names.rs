//! Names in keys: those of groups instead of their numbers, and names of columns.

use std::collections::HashMap;

use toml::de::{DeTable, DeValue};

/// The names that the keys of a scenario can have.
#[derive(Debug, Clone, Default)]
pub struct KeyNames {
    /// The names of the groups of robots, in the order of the file.
    groups: Vec<String>,
    /// The global that each event sets, in the order of the file.
    event_globals: Vec<Option<String>>,
    /// The name of each expectation.
    expects: Vec<Option<String>>,
}

/// A key with the name of a group that the scenario does not have.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnknownName {
    /// The name, or its beginning if it has a dot.
    pub name: String,
    /// The names of the groups.
    pub groups: Vec<String>,
}

impl KeyNames {
    /// Finds the names in the text of a scenario. A text that is not TOML has none.
    pub fn of(text: &str) -> Self {
        let (document, _) = DeTable::parse_recoverable(text);
        let document = document.get_ref();
        let texts = |section: &str, key: &str| -> Vec<Option<String>> {
            let Some(DeValue::Array(items)) = document.get(section).map(|item| item.get_ref())
            else {
                return Vec::new();
            };
            let text = |item: &DeValue<'_>| match item {
                DeValue::Table(table) => {
                    table.get(key).and_then(|value| value.get_ref().as_str()).map(str::to_owned)
                }
                _ => None,
            };
            items.iter().map(|item| text(item.get_ref())).collect()
        };
        let (names, robots) = (texts("robots", "name"), texts("robots", "robot"));
        let mut numbers: HashMap<&str, u32> = HashMap::new();
        let mut groups: Vec<String> = Vec::new();
        // A group without a name has that of its robot, with a number if a group before has it.
        for (name, robot) in names.into_iter().zip(&robots) {
            // A robot file mostly has the name of its robot.
            let robot = robot.as_deref().unwrap_or_default();
            let file = robot.strip_suffix(".toml").and_then(|path| path.rsplit(['/', '\\']).next());
            let robot = file.unwrap_or(robot);
            let name = name.unwrap_or_else(|| {
                let number = numbers.entry(robot).or_insert(1);
                loop {
                    let name = match *number {
                        1 => robot.to_owned(),
                        number => format!("{robot}-{number}"),
                    };
                    *number += 1;
                    if !groups.contains(&name) {
                        return name;
                    }
                }
            });
            groups.push(name);
        }
        KeyNames {
            groups,
            event_globals: texts("event", "global"),
            expects: texts("expect", "name"),
        }
    }

    /// Returns a key with the number of its group instead of the name: `robots.0.count` for
    /// `robots.walkers.count`. Other keys stay as they are.
    pub fn indexed(&self, key: &str) -> Result<String, UnknownName> {
        let Some(rest) = key.strip_prefix("robots.") else { return Ok(key.to_owned()) };
        let first = rest.split('.').next().unwrap_or_default();
        if first.parse::<usize>().is_ok() {
            return Ok(key.to_owned());
        }
        let groups = self.groups.iter().enumerate();
        // A name may have dots, and be the beginning of another one.
        let found = groups
            .filter_map(|(number, name)| {
                let rest = rest.strip_prefix(name.as_str())?;
                (rest.is_empty() || rest.starts_with('.')).then_some((number, name, rest))
            })
            .max_by_key(|(_, name, _)| name.len());
        match found {
            Some((number, _, rest)) => Ok(format!("robots.{number}{rest}")),
            None => Err(UnknownName { name: first.to_owned(), groups: self.groups.clone() }),
        }
    }

    /// Returns the names of the columns for keys, each with its own name if it has one. A name that
    /// two keys would have, or a column of `taken`, gets the group before it, or is the whole key.
    pub fn columns(&self, keys: &[(&str, Option<&str>)], taken: &[&str]) -> Vec<String> {
        let forms: Vec<[String; 3]> = keys.iter().map(|(key, _)| self.forms(key)).collect();
        let own = |index: usize| keys[index].1;
        let of = |index: usize, form: usize| match own(index) {
            Some(name) => name.to_owned(),
            None => forms[index][form].clone(),
        };
        let is_free = |index: usize, form: usize| {
            let name = of(index, form);
            let mut others = (0..keys.len()).filter(|other| *other != index);
            !taken.contains(&name.as_str()) && others.all(|other| of(other, form) != name)
        };
        let name = |index: usize| {
            let form = (0..forms[index].len()).find(|form| is_free(index, *form));
            of(index, form.unwrap_or(forms[index].len() - 1))
        };
        (0..keys.len()).map(name).collect()
    }

    /// Returns the forms of a column's name: the shortest, one with the group, and the key.
    fn forms(&self, key: &str) -> [String; 3] {
        let indexed = self.indexed(key).unwrap_or_else(|_| key.to_owned());
        let whole = key.to_owned();
        let words: Vec<&str> = indexed.splitn(3, '.').collect();
        let &[section, number, rest] = words.as_slice() else {
            return [whole.clone(), whole.clone(), whole];
        };
        let name = |names: &[Option<String>]| -> Option<String> {
            names.get(number.parse::<usize>().ok()?)?.clone()
        };
        match (section, rest.strip_prefix("globals.")) {
            ("robots", global) => {
                let Some(group) =
                    number.parse().ok().and_then(|number: usize| self.groups.get(number))
                else {
                    return [whole.clone(), whole.clone(), whole];
                };
                match global {
                    Some(global) => [global.to_owned(), format!("{group}.{global}"), whole],
                    None => [format!("{group}.{rest}"), format!("{group}.{rest}"), whole],
                }
            }
            ("event", _) if rest == "number" => match name(&self.event_globals) {
                Some(global) => [global.clone(), format!("event.{global}"), whole],
                None => [whole.clone(), whole.clone(), whole],
            },
            ("expect", _) => match name(&self.expects) {
                Some(name) => [format!("{name}.{rest}"), format!("{name}.{rest}"), whole],
                None => [whole.clone(), whole.clone(), whole],
            },
            _ => [whole.clone(), whole.clone(), whole],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "[[robots]]\nrobot = \"kilobot\"\nname = \"walkers\"\n\
        [[robots]]\nrobot = \"kilobot\"\n[[robots]]\nrobot = \"kilobot\"\n\
        [[robots]]\nrobot = \"zooids\"\nname = \"walkers.fast\"\n\
        [[event]]\nat = 0\nset = \"all\"\nglobal = \"GROUP\"\nnumber = 1\n\
        [[expect]]\nat = 1\n[[expect]]\nname = \"agree\"\nat = 1\n";

    #[test]
    fn groups_have_names_in_keys() {
        let names = KeyNames::of(TEXT);
        for (key, indexed) in [
            ("robots.walkers.count", "robots.0.count"),
            ("robots.kilobot.globals.GROUP", "robots.1.globals.GROUP"),
            ("robots.kilobot-2.count", "robots.2.count"),
            ("robots.walkers.fast.count", "robots.3.count"),
            ("robots.walkers", "robots.0"),
            ("robots.7.count", "robots.7.count"),
            ("medium.ir.loss", "medium.ir.loss"),
            ("robots", "robots"),
        ] {
            assert_eq!(names.indexed(key).as_deref(), Ok(indexed), "{key}");
        }
        let error = names.indexed("robots.walker.count").unwrap_err();
        assert_eq!(error.name, "walker");
        assert_eq!(error.groups, ["walkers", "kilobot", "kilobot-2", "walkers.fast"]);
        assert!(KeyNames::of("[world").indexed("robots.a.count").is_err());
        let file = KeyNames::of("[[robots]]\nrobot = \"../robots/rover.toml\"\n");
        assert_eq!(file.indexed("robots.rover.count").as_deref(), Ok("robots.0.count"));
    }

    #[test]
    fn columns_are_named_after_parameters() {
        let names = KeyNames::of(TEXT);
        let columns = |keys: &[&str]| {
            let keys: Vec<(&str, Option<&str>)> = keys.iter().map(|key| (*key, None)).collect();
            names.columns(&keys, &["seed", "sent"]).join(" ")
        };
        assert_eq!(columns(&["robots.0.globals.RHO"]), "RHO");
        assert_eq!(
            columns(&["robots.walkers.globals.RHO", "medium.ir.loss"]),
            "RHO medium.ir.loss"
        );
        assert_eq!(
            columns(&["robots.0.globals.RHO", "robots.1.globals.RHO"]),
            "walkers.RHO kilobot.RHO"
        );
        assert_eq!(columns(&["robots.0.globals.sent"]), "walkers.sent");
        assert_eq!(
            columns(&["robots.0.count", "robots.kilobot.count"]),
            "walkers.count kilobot.count"
        );
        assert_eq!(columns(&["event.0.number"]), "GROUP");
        assert_eq!(
            columns(&["event.0.number", "robots.0.globals.GROUP"]),
            "event.GROUP walkers.GROUP"
        );
        assert_eq!(columns(&["event.0.at", "event.1.number"]), "event.0.at event.1.number");
        assert_eq!(columns(&["expect.0.below", "expect.1.below"]), "expect.0.below agree.below");
        assert_eq!(columns(&["world.seed", "robots.9.count"]), "world.seed robots.9.count");
        let named = [("robots.0.globals.A", Some("alpha")), ("robots.0.globals.alpha", None)];
        assert_eq!(names.columns(&named, &[]), ["alpha", "walkers.alpha"]);
    }
}
