//! Parts that a machine may be built without, where flash is scarce.
//!
//! The firmware's [`ByteCode`](crate::ByteCode) determines the parts of its machine by the constant
//! [`ByteCode::PARTS`](crate::ByteCode::PARTS). A test for a part therefore costs nothing, and the
//! code of a missing part is left out. All other machines have all parts, including those of robots
//! whose script is exchanged without the firmware. A script that uses a missing part is refused
//! where its image is sealed, see [`crate::seal`]. The verifier refuses a script that declares a
//! [feature](crate::builtin::Feature) of which all parts are missing.

use crate::builtin::{self, BuiltinInfo, BuiltinKind, Feature, Library};
use crate::image::{CAPTURES, USES_SELF};
use crate::opcode;

macro_rules! parts {
    ($($part:ident = $number:literal, $name:literal, $what:literal;)*) => {
        /// A part of the machine.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        #[repr(u8)]
        pub enum Part {
            $(#[doc = $what] $part = $number,)*
        }

        impl Part {
            /// Every part.
            pub const ALL: &[Part] = &[$(Part::$part,)*];

            /// Returns the name of the part, as tools print it.
            pub const fn name(self) -> &'static str {
                match self { $(Part::$part => $name,)* }
            }

            /// Returns the constructs of scripts that need it.
            pub const fn what(self) -> &'static str {
                match self { $(Part::$part => $what,)* }
            }
        }
    };
}

parts! {
    Floats = 0, "floats", "numbers with a fraction, and distances";
    Maths = 1, "maths", "functions of `math` with float results, and `^`";
    Iteration = 2, "iteration", "`foreach`, `map`, `filter`, `reduce` and `clone`";
    Libraries = 3, "libraries", "libraries, swarms, stigmergies and snapshots in variables";
    Closures = 4, "closures", "functions that use `self` or variables of the function around them";
    Neighbors = 5, "neighbors", "what is known of neighbors: `neighbors.get`, `count`, `foreach`, `kin` ...";
    Messages = 6, "messages", "`neighbors.broadcast`, `listen` and `ignore`";
    LongMessages = 7, "long_messages", "tables, functions and texts in messages";
    Swarms = 8, "swarms", "`swarm`";
    Stigmergy = 9, "stigmergy", "`stigmergy`";
    Conflicts = 10, "conflicts", "`onconflict`";
    LostConflicts = 11, "lost_conflicts", "`onconflictlost`";
}

/// A set of parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Parts(u16);

impl Parts {
    /// No parts.
    pub const NONE: Parts = Parts(0);
    /// All parts.
    pub const ALL: Parts = Parts((1 << Part::ALL.len()) - 1);
    /// The parts of the language itself. A script that uses no other robots needs only these and
    /// `maths`.
    pub const LANGUAGE: Parts =
        Parts::of(&[Part::Floats, Part::Iteration, Part::Libraries, Part::Closures]);

    /// Returns the set of these parts.
    pub const fn of(parts: &[Part]) -> Parts {
        let mut bits = 0;
        let mut index = 0;
        while index < parts.len() {
            bits |= 1 << parts[index] as u8;
            index += 1;
        }
        Parts(bits)
    }

    /// Returns the set with these bits, see [`Parts::bits`]. Bits that no part has are dropped.
    pub const fn from_bits(bits: u16) -> Parts {
        Parts(bits & Parts::ALL.0)
    }

    /// Returns the set as bits: bit `i` stands for the part of number `i`.
    pub const fn bits(self) -> u16 {
        self.0
    }

    /// Returns true if the set has that part.
    #[hot]
    pub const fn has(self, part: Part) -> bool {
        self.0 & 1 << part as u8 != 0
    }

    /// Returns the union of both sets.
    pub const fn and(self, others: Parts) -> Parts {
        Parts(self.0 | others.0)
    }

    /// Returns these parts without the others.
    pub const fn without(self, others: Parts) -> Parts {
        Parts(self.0 & !others.0)
    }

    /// Returns each part of the set.
    pub fn iter(self) -> impl Iterator<Item = Part> {
        Part::ALL.iter().copied().filter(move |part| self.has(*part))
    }

    /// Returns the parts that a built-in needs.
    pub fn of_builtin(info: &BuiltinInfo) -> Parts {
        let mut parts = match info.library {
            _ if info.feature == Feature::Maths => Parts::of(&[Part::Floats, Part::Maths]),
            Library::Neighbors => match info.number {
                builtin::NEIGHBORS_BROADCAST..=builtin::NEIGHBORS_IGNORE => {
                    Parts::of(&[Part::Messages])
                }
                builtin::NEIGHBORS_COUNT => Parts::of(&[Part::Neighbors]),
                builtin::NEIGHBORS_KIN | builtin::NEIGHBORS_NONKIN => {
                    Parts::of(&[Part::Neighbors, Part::Floats, Part::Swarms])
                }
                _ => Parts::of(&[Part::Neighbors, Part::Floats]),
            },
            Library::Snapshot => Parts::of(&[Part::Neighbors, Part::Libraries]),
            Library::Swarm => Parts::of(&[Part::Swarms]),
            Library::SwarmObject => Parts::of(&[Part::Swarms, Part::Libraries]),
            Library::Stigmergy => Parts::of(&[Part::Stigmergy]),
            Library::StigmergyObject => match info.number {
                builtin::STIGMERGY_ONCONFLICT => {
                    Parts::of(&[Part::Stigmergy, Part::Libraries, Part::Conflicts])
                }
                builtin::STIGMERGY_ONCONFLICTLOST => {
                    Parts::of(&[Part::Stigmergy, Part::Libraries, Part::LostConflicts])
                }
                _ => Parts::of(&[Part::Stigmergy, Part::Libraries]),
            },
            Library::Position => Parts::of(&[Part::Floats, Part::Libraries]),
            Library::Global | Library::Math | Library::Rng | Library::String => match info.number {
                builtin::TO_FLOAT | builtin::PI => Parts::of(&[Part::Floats]),
                _ => Parts::NONE,
            },
        };
        if info.kind == BuiltinKind::Calls
            && !matches!(info.number, builtin::DELAY | builtin::SWARM_EXEC)
        {
            parts = parts.and(Parts::of(&[Part::Iteration]));
        }
        parts
    }

    /// Returns the parts that an instruction needs, apart from those of its operand.
    pub const fn of_opcode(opcode: u8) -> Parts {
        match opcode {
            opcode::FLOAT | opcode::FLOAT_HALF => Parts::of(&[Part::Floats]),
            opcode::POW => Parts::of(&[Part::Floats, Part::Maths]),
            opcode::LIBRARY => Parts::of(&[Part::Libraries]),
            opcode::CLOSURE | opcode::CAPTURE_GET => Parts::of(&[Part::Closures]),
            _ => Parts::NONE,
        }
    }

    /// Returns the parts that a function needs, by the first byte of its header.
    pub const fn of_function(head: u8) -> Parts {
        if head & (CAPTURES | USES_SELF) != 0 { Parts::of(&[Part::Closures]) } else { Parts::NONE }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_numbered_in_order() {
        for (number, part) in Part::ALL.iter().enumerate() {
            assert_eq!(*part as usize, number);
            assert_eq!(Parts::of(&[*part]).bits(), 1 << number);
            assert_eq!(Parts::of(&[*part]).iter().next(), Some(*part));
        }
        assert_eq!(Parts::from_bits(u16::MAX), Parts::ALL);
        assert_eq!(Parts::ALL.without(Parts::ALL), Parts::NONE);
    }

    #[test]
    fn parts_of_built_ins_follow_their_features() {
        for info in builtin::TABLE {
            let parts = Parts::of_builtin(info);
            let has = |part| parts.has(part);
            let is_kin = matches!(info.number, builtin::NEIGHBORS_KIN | builtin::NEIGHBORS_NONKIN);
            let is_of_swarm = info.feature == Feature::Swarm || is_kin;
            assert_eq!(has(Part::Maths), info.feature == Feature::Maths, "{}", info.name);
            assert_eq!(has(Part::Swarms), is_of_swarm, "{}", info.name);
            assert_eq!(has(Part::Stigmergy), info.feature == Feature::Stigmergy, "{}", info.name);
            let near = has(Part::Neighbors) || has(Part::Messages);
            assert_eq!(near, info.feature == Feature::Neighbors, "{}", info.name);
            if info.library.is_object() {
                assert!(has(Part::Libraries), "{}", info.name);
            }
        }
    }
}
