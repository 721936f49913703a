//! Sentences for the reasons why the virtual machine refuses an image.

use bittybuzz_vm_core::ImageError;
use bittybuzz_vm_core::builtin::Feature;
use bittybuzz_vm_core::image::VERSION;

/// Returns the reason as the rest of a sentence that begins with the name of the image.
pub fn sentence(cause: &ImageError) -> String {
    match cause {
        ImageError::NotAnImage => "is not an image".to_owned(),
        ImageError::Version(version) => {
            let age = if *version < u16::from(VERSION) { "older" } else { "newer" };
            format!(
                "is an image of version {version}, {age} than version {VERSION}, which this `bbz` runs"
            )
        }
        ImageError::Profile => "was built for the other number profile".to_owned(),
        ImageError::Truncated => "is cut off: it ends in the middle of its tables".to_owned(),
        ImageError::TooLong => "is too long for an image".to_owned(),
        ImageError::Features(missing) => {
            format!("needs {}, which this virtual machine lacks", features(*missing))
        }
        ImageError::RobotFunction(hash) => {
            format!("calls a function that the robot does not have (name hash {hash:04x})")
        }
        ImageError::TooManyGlobals(globals) => {
            format!("has {globals} globals, which alone fill the memory of the robot")
        }
        ImageError::TooManyJumps(_) => {
            "has a function with so many jumps that the robot has no memory to check them"
                .to_owned()
        }
        ImageError::Entry(number) => {
            let name = ["init", "step", "reset", "destroy"].get(usize::from(*number));
            damaged(&format!("it names no function for {}()", name.unwrap_or(&"an entry")))
        }
        ImageError::LibraryTable(row) => {
            damaged(&format!("row {row} of its library table is wrong"))
        }
        ImageError::Function(number) => {
            damaged(&format!("the header of function {number} is wrong"))
        }
        ImageError::Instruction(at) => damaged(&format!("there is no such instruction at {at}")),
        ImageError::Operand(at) => {
            damaged(&format!("the instruction at {at} names something that does not exist"))
        }
        ImageError::Depth(at) => damaged(&format!("the operand stack does not add up at {at}")),
        ImageError::Jump(at) => damaged(&format!("the jump at {at} leads nowhere")),
        ImageError::NoReturn(at) => {
            damaged(&format!("the function that ends at byte {at} runs over its end"))
        }
        ImageError::Seal => "is not sealed for this robot, or was changed since".to_owned(),
        // `ImageError` may get more variants.
        other => damaged(&format!("{other:?}")),
    }
}

/// Returns advice how to make the image loadable.
pub fn help(cause: &ImageError) -> Option<String> {
    let help = match cause {
        ImageError::Version(version) if *version > u16::from(VERSION) => {
            "use the `bbz` that built it, or build it again from its script with this one"
        }
        ImageError::Features(missing) if *missing == Feature::StigmergyTable as u16 => {
            "build the firmware of the robot again, which is older than this `bbz`"
        }
        ImageError::Features(_) => "leave it out of the script",
        ImageError::RobotFunction(_) => {
            "build the script for this robot, or name its robot with --robot"
        }
        ImageError::TooManyGlobals(_) => "use local variables, or keep values in a table",
        ImageError::TooManyJumps(_) => "split the function, or build for a robot with more memory",
        ImageError::Seal => {
            "`bbz flash` seals it; if the robot still refuses it, build the firmware of the robot again"
        }
        _ => "build it again from its script with this `bbz`",
    };
    Some(help.to_owned())
}

fn damaged(how: &str) -> String {
    format!("is damaged: {how}")
}

/// Returns the names of the features whose bits are set.
fn features(bits: u16) -> String {
    let named = [
        (Feature::Maths, "the functions of `math`"),
        (Feature::Strings, "strings made at run time (`string`)"),
        (Feature::Neighbors, "`neighbors`"),
        (Feature::Swarm, "`swarm`"),
        (Feature::Stigmergy, "`stigmergy`"),
        (Feature::LongMessages, "messages of several frames"),
        (Feature::StigmergyTable, "a table of stigmergies"),
    ];
    let known = named.iter().fold(0, |bits, (feature, _)| bits | *feature as u16);
    let names = named.iter().filter(|(feature, _)| bits & *feature as u16 != 0);
    let mut names: Vec<&str> = names.map(|(_, name)| *name).collect();
    if bits & !known != 0 {
        names.push("parts that this version does not know");
    }
    names.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_features_are_named() {
        let message = |bits| sentence(&ImageError::Features(bits));
        assert_eq!(message(0x08), "needs `swarm`, which this virtual machine lacks");
        assert_eq!(
            message(0x90),
            "needs `stigmergy`, a table of stigmergies, which this virtual machine lacks"
        );
        // A robot with newer firmware may report more bits.
        assert_eq!(
            message(0x101),
            "needs the functions of `math`, parts that this version does not know, which this virtual machine lacks"
        );
    }

    #[test]
    fn a_machine_without_the_table_is_older() {
        let help = |bits| help(&ImageError::Features(bits)).expect("there is advice");
        assert!(help(0x80).contains("firmware"));
        assert_eq!(help(0x90), "leave it out of the script");
    }

    #[test]
    fn an_image_without_a_seal_is_flashed_again() {
        let help = help(&ImageError::Seal).expect("there is advice");
        assert!(help.starts_with("`bbz flash` seals it"), "{help}");
    }
}
