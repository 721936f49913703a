//! Mistakes for which an experiment is refused, and their cures.

use bittybuzz_toml_reader::{number_text, one_of};
use roxmltree::Error as XmlError;

/// The largest number of robots, and of obstacles and lamps, that a file distributes.
pub const ROBOTS_MAX: u32 = 0x1_0000;
pub const FIXED_MAX: u32 = 2000;

/// The numbers that an attribute may have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Allowed {
    Any,
    NotNegative,
    Positive,
    /// A whole number up to this one.
    Whole(u32),
    /// A whole number above 0.
    Count(u32),
    Share,
}

impl Allowed {
    pub fn contains(self, number: f64) -> bool {
        match self {
            Allowed::Any => true,
            Allowed::NotNegative => number >= 0.0,
            Allowed::Positive => number > 0.0,
            Allowed::Whole(most) => number.fract() == 0.0 && (0.0..=most.into()).contains(&number),
            Allowed::Count(most) => number.fract() == 0.0 && (1.0..=most.into()).contains(&number),
            Allowed::Share => (0.0..=1.0).contains(&number),
        }
    }
}

/// A reason why an experiment cannot be imported.
#[derive(Debug, thiserror::Error)]
pub enum Mistake {
    #[error("this is not the XML of an experiment: {message}")]
    NotXml { message: String, cure: &'static str },
    #[error("there is no <arena>")]
    NoArena,
    #[error("a second <arena>")]
    SecondArena { first: usize },
    #[error("<{element}> has no <{missing}>")]
    NoElement { element: String, missing: &'static str },
    #[error("<{element}> has no `{attribute}`")]
    NoAttribute { element: String, attribute: &'static str },
    #[error("`{attribute}` needs a number, not \"{text}\"")]
    NoNumber { attribute: &'static str, text: String },
    #[error("`{attribute}` is too long")]
    TooLong { attribute: &'static str, most: usize },
    #[error("`{attribute}` has too few numbers: {found} instead of 3")]
    TooFew { attribute: &'static str, found: usize },
    #[error("`{attribute}` cannot be {}", number_text(*number))]
    OutOfRange { attribute: &'static str, number: f64, allowed: Allowed },
    /// A size or place beyond the largest world.
    #[error("`{attribute}` does not fit into a world")]
    BeyondWorld { attribute: &'static str },
    #[error("there is no controller `{name}`")]
    NoController { name: String, known: Vec<String> },
    #[error("there is no distribution `{name}`")]
    NoMethod { name: String },
    #[error("`min` is greater than `max`")]
    MinAboveMax,
    #[error("{quantity} entities do not fit into the {places} places of the grid")]
    SmallGrid { quantity: u32, places: u64 },
    #[error("`quantity` = {quantity} is too much")]
    TooMany { quantity: u32 },
    #[error("<entity> has no entity to distribute")]
    NothingToDistribute,
}

/// The methods of `<distribute>`.
pub const METHODS: [&str; 4] = ["uniform", "gaussian", "constant", "grid"];

impl Mistake {
    /// Returns the mistake of a text that is not XML.
    pub fn from_xml(error: &XmlError, message: String) -> Self {
        let cure = match error {
            XmlError::DtdDetected => "delete the document type (<!DOCTYPE ...>) and its entities",
            XmlError::InvalidComment(_) => "`--` may only end a comment",
            XmlError::UnknownEntityReference(..) | XmlError::MalformedEntityReference(_) => {
                "write `&amp;` for the character `&`"
            }
            XmlError::InvalidAttributeValue(_) => "write `&lt;` for the character `<`",
            XmlError::DuplicatedAttribute(..) => "keep one of both",
            XmlError::UnexpectedCloseTag(..)
            | XmlError::UnclosedRootNode
            | XmlError::UnexpectedEndOfStream => "each <tag> needs its </tag>, or ends with />",
            XmlError::NoRootNode => "an experiment is an <argos-configuration>",
            _ => "correct the text at this place",
        };
        let message = match error {
            XmlError::DtdDetected => "it has a document type".to_owned(),
            _ => message,
        };
        Mistake::NotXml { message, cure }
    }

    /// Returns the cure.
    pub fn help(&self) -> String {
        match self {
            Mistake::NotXml { cure, .. } => (*cure).to_owned(),
            Mistake::NoArena => {
                "an experiment of ARGoS has <arena size=\"X,Y,Z\"> in <argos-configuration>".to_owned()
            }
            Mistake::SecondArena { first } => {
                format!("the first is in line {first}, and ARGoS reads only that one; delete the other")
            }
            Mistake::NoElement { missing, .. } => format!("ARGoS needs it too: add <{missing} ...>"),
            Mistake::NoAttribute { attribute, .. } => {
                format!("ARGoS needs it too: add {attribute}=\"...\"")
            }
            Mistake::NoNumber { .. } => {
                "write a number such as 0.5; a template needs its values first".to_owned()
            }
            Mistake::TooLong { most, .. } => format!("at most {most} bytes"),
            Mistake::TooFew { .. } => "write x, y and z as in \"2,0.5,0\"".to_owned(),
            Mistake::OutOfRange { allowed, .. } => match allowed {
                Allowed::Any => "a number".to_owned(),
                Allowed::NotNegative => "a number from 0 on".to_owned(),
                Allowed::Positive => "a number above 0".to_owned(),
                Allowed::Whole(most) => format!("a whole number from 0 to {most}"),
                Allowed::Count(most) => format!("a whole number from 1 to {most}"),
                Allowed::Share => "a number from 0 to 1".to_owned(),
            },
            Mistake::BeyondWorld { .. } => {
                "sides of a world have 0.01 m to 1000 m, and places are at most 500 m from its center"
                    .to_owned()
            }
            Mistake::NoController { name, known } if known.is_empty() => {
                format!("add a controller with id=\"{name}\" to <controllers>")
            }
            Mistake::NoController { name, known } => one_of(name, known),
            Mistake::NoMethod { name } => one_of(name, &METHODS),
            Mistake::MinAboveMax => "exchange the numbers; each of `min` is at most that of `max`".to_owned(),
            Mistake::SmallGrid { .. } => "reduce `quantity`, or enlarge `layout`".to_owned(),
            Mistake::TooMany { .. } => {
                format!("a file may distribute {ROBOTS_MAX} robots, and {FIXED_MAX} obstacles and lamps")
            }
            Mistake::NothingToDistribute => {
                "add one, such as <foot-bot id=\"fb\"><controller config=\"...\"/></foot-bot>".to_owned()
            }
        }
    }
}
