//! The functions that robots provide to the script: those of the target robot, or those of all
//! known robots if no robot is named.

use bittybuzz_robot_spec::{Robot, RobotFunction, table_of};
use bittybuzz_vm_core::builtin::{self, Library};

/// Returns the names of a robot's functions and tables. Some names occur several times: those of tables
/// in which functions and values stand.
fn names(robot: &Robot) -> impl Iterator<Item = &str> {
    let functions = robot.functions.iter().map(|function| function.name.as_str());
    let values = robot.values.iter().map(|value| value.path.text());
    let tables = robot.tables.iter().map(|table| table.name.as_str());
    functions.chain(values).map(table_of).chain(tables)
}

/// The robots that a script is compiled for.
#[derive(Debug, Clone, Copy)]
pub struct KnownRobots<'a> {
    /// The target robot. If it is `None`, the functions of all known robots are accepted.
    pub target: Option<&'a Robot>,
    /// All known robots.
    pub known: &'a [Robot],
}

impl<'a> KnownRobots<'a> {
    /// Returns the robots that run the script.
    pub fn targets(self) -> impl Iterator<Item = &'a Robot> {
        let any: &[Robot] = if self.target.is_some() { &[] } else { self.known };
        self.target.into_iter().chain(any)
    }

    /// Returns the functions of that name on the robots that run the script. There can be more than
    /// one only if no robot is named.
    pub fn functions(self, name: &str) -> Vec<&'a RobotFunction> {
        self.targets().filter_map(|robot| robot.function(name)).collect()
    }

    /// Returns true if the table exists on a robot that runs the script.
    pub fn has_table(self, name: &str) -> bool {
        self.targets().any(|robot| robot.table(name).is_some())
    }

    /// Returns true if the field of a table exists on a robot that runs the script.
    fn has_field(self, table: &str, field: &str) -> bool {
        let mut tables = self.targets().filter_map(|robot| robot.table(table));
        tables.any(|table| table.fields.iter().any(|known| known.name == field))
    }

    /// Returns the titles of the known robots that have a function or table of that name.
    pub fn elsewhere(self, name: &str) -> Vec<&'a str> {
        let has = |robot: &&Robot| names(robot).any(|known| known == name);
        self.known.iter().filter(has).map(|robot| robot.title.as_str()).collect()
    }

    /// Returns the names of all functions and tables of the robots that run the script.
    pub fn names(self) -> impl Iterator<Item = &'a str> {
        self.targets().flat_map(names)
    }

    /// Returns the members of a library that exist on the robots that run the script.
    pub fn members(self, library: Library) -> impl Iterator<Item = &'static builtin::BuiltinInfo> {
        let of_library = builtin::TABLE.iter().filter(move |info| info.library == library);
        of_library.filter(move |info| match (library, library.global_name()) {
            (Library::Position, Some(table)) => self.has_field(table, info.name),
            _ => true,
        })
    }

    /// Returns the member of a library with that name, if it exists on the robots that run the
    /// script.
    pub fn member(self, library: Library, name: &str) -> Option<&'static builtin::BuiltinInfo> {
        self.members(library).find(|info| info.name == name)
    }
}
