//! Checks that a robot can run an image before the image is sent to it. The check needs only the
//! robot's file and the image.

mod code;
mod stack;

use std::borrow::Cow;
use std::fmt;

use bittybuzz_robot_spec::{NumberProfile, Robot};
use bittybuzz_vm_core::builtin::{self, Feature};
use bittybuzz_vm_core::image::{BESIDE_GLOBALS, ImageHeader};
use bittybuzz_vm_core::number::{self, Full, Tiny};
use bittybuzz_vm_core::opcode::{self, Operand};
use bittybuzz_vm_core::seal;
use bittybuzz_vm_core::{Image, ImageError, Part, Parts, SLOTS_MAX, Sizes, Vm, features};

use code::DecodedInstruction;
pub use stack::CallPath;

/// Bytes per row of the library table.
const ROW: usize = 4;

type Machine<'a, P> = Box<Vm<P, &'a [u8], SLOTS_MAX>>;

/// A reason why a robot cannot run an image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CapacityError {
    /// The robot's virtual machine is built without a feature that the script needs.
    Feature {
        /// The name of the feature in scripts.
        name: &'static str,
        /// The first instruction that needs the feature, if there is such an instruction.
        at: Option<usize>,
    },
    /// The firmware's virtual machine is built without a part that the script uses.
    Part {
        part: Part,
        /// The first instruction that uses the part, if there is such an instruction.
        at: Option<usize>,
    },
    /// The image is larger than the flash that is reserved for it.
    Flash {
        /// Size of the image in bytes.
        bytes: usize,
        /// Size of the reserved flash in bytes.
        most: usize,
    },
    /// There are more globals than the robot's memory holds.
    Globals {
        globals: usize,
        /// The maximum number of globals.
        most: usize,
        /// The number of slots of the robot.
        slots: usize,
    },
    /// Globals and stack together need more than the robot's memory.
    Stack {
        /// The chain of calls that needs the most stack.
        path: CallPath,
        /// The number of slots for globals.
        globals: usize,
        /// The number of slots of the robot.
        slots: usize,
    },
}

/// Returns the reasons why a robot cannot run the image. The image must be one that the verifier
/// accepts; for others the list may be incomplete.
pub fn capacity_errors(image: &[u8], robot: &Robot) -> Vec<CapacityError> {
    let Ok(header) = Image::new(image).header() else { return Vec::new() };
    let slots = robot.vm.slots as usize;
    let mut found = lacking(image, &header, robot);
    let missing = uses(image, &header).into_iter().filter(|(part, _)| !robot.parts.has(*part));
    found.extend(missing.map(|(part, at)| CapacityError::Part { part, at }));
    let most = match (robot.layout, robot.budget) {
        (Some(layout), _) => layout.most_script() as usize,
        (None, Some(budget)) => budget.flash_bytes as usize,
        (None, None) => usize::MAX,
    };
    if image.len() > most {
        found.push(CapacityError::Flash { bytes: image.len(), most });
    }
    let globals = usize::from(header.globals());
    if globals + BESIDE_GLOBALS > slots {
        found.push(CapacityError::Globals {
            globals,
            most: slots.saturating_sub(BESIDE_GLOBALS),
            slots,
        });
        return found;
    }
    let path = stack::deepest(image, &header);
    if globals + path.slots > slots {
        found.push(CapacityError::Stack { path, globals, slots });
    }
    found
}

/// Returns the parts of the machine that a script uses.
pub fn parts(image: &[u8]) -> Parts {
    let Ok(header) = Image::new(image).header() else { return Parts::NONE };
    let parts: Vec<Part> = uses(image, &header).into_iter().map(|(part, _)| part).collect();
    Parts::of(&parts)
}

/// Returns the parts of the machine that a script uses, each with the first instruction that uses
/// it, if there is such an instruction.
fn uses(image: &[u8], header: &ImageHeader) -> Vec<(Part, Option<usize>)> {
    let mut found: Vec<(Part, Option<usize>)> = Vec::new();
    let mut note = |parts: Parts, at: Option<usize>| {
        for part in parts.iter() {
            if found.iter().all(|(known, _)| *known != part) {
                found.push((part, at));
            }
        }
    };
    for number in 0..header.functions() {
        let [head, _] = code::head(image, header, number);
        for instruction in code::instructions(image, header, number) {
            let opcode = instruction.info.byte;
            let mut parts = Parts::of_opcode(opcode).and(Parts::of_function(head));
            if matches!(opcode, opcode::BUILTIN | opcode::CALL_BUILTIN)
                && let Some(info) = u8::try_from(instruction.operand).ok().and_then(builtin::info)
            {
                parts = parts.and(Parts::of_builtin(info));
            }
            note(parts, Some(instruction.at));
        }
    }
    // The machine finds these members by name, so the first instruction that may use one is that
    // with the same string as its operand.
    for row in 0..usize::from(header.library_rows()) {
        let at = usize::from(header.libraries_at()) + ROW * row;
        let Some([_, low, high, number]) = image.get(at..at + ROW) else { break };
        let string = i16::from_le_bytes([*low, *high]);
        let mut asks = (0..header.functions()).flat_map(|n| code::instructions(image, header, n));
        let asks = asks.find(|asks| asks.info.operand == Operand::String && asks.operand == string);
        let parts = builtin::info(*number).map_or(Parts::NONE, Parts::of_builtin);
        note(parts, asks.map(|instruction| instruction.at));
    }
    if header.features() & Feature::LongMessages as u8 != 0 {
        let mut all = (0..header.functions()).flat_map(|n| code::instructions(image, header, n));
        let says = |number: i16| {
            number == i16::from(builtin::NEIGHBORS_BROADCAST)
                || number == i16::from(builtin::STIGMERGY_CREATE)
        };
        let first = all.find(|one| one.info.byte == opcode::CALL_BUILTIN && says(one.operand));
        note(Parts::of(&[Part::LongMessages]), first.map(|instruction| instruction.at));
    }
    found
}

/// Returns the features that the script needs and the robot lacks.
fn lacking(image: &[u8], header: &ImageHeader, robot: &Robot) -> Vec<CapacityError> {
    let instructions: Vec<DecodedInstruction> = (0..header.functions())
        .flat_map(|number| code::instructions(image, header, number))
        .collect();
    let parts = [
        (Feature::Maths, robot.vm.maths, "math"),
        (Feature::Neighbors, robot.vm.neighbors > 0, "neighbors"),
        (Feature::Swarm, robot.vm.swarms > 0, "swarm"),
        (Feature::Stigmergy, robot.vm.stigmergy_entries > 0, "stigmergy"),
    ];
    let missing = parts.into_iter().filter_map(|(feature, is_there, name)| {
        let first = instructions.iter().find(|instruction| needs(instruction, feature));
        let is_needed = first.is_some() || header.features() & feature as u8 != 0;
        let at = first.map(|instruction| instruction.at);
        (is_needed && !is_there).then_some(CapacityError::Feature { name, at })
    });
    missing.collect()
}

fn needs(instruction: &DecodedInstruction, feature: Feature) -> bool {
    match instruction.info.byte {
        opcode::POW => feature == Feature::Maths,
        opcode::BUILTIN | opcode::CALL_BUILTIN => builtin::TABLE
            .iter()
            .find(|info| i16::from(info.number) == instruction.operand)
            .is_some_and(|info| info.feature == feature),
        _ => false,
    }
}

impl CapacityError {
    /// Returns the message for the diagnostic.
    pub fn message(&self, robot: &Robot, function: &dyn Fn(u16) -> String) -> String {
        let title = &robot.title;
        match self {
            CapacityError::Feature { name, .. } => format!("the {title} is built without `{name}`"),
            CapacityError::Part { part, .. } => {
                format!("the firmware is built without `{}`: {}", part.name(), part.what())
            }
            CapacityError::Flash { bytes, most } => {
                format!("the image has {bytes} bytes, the {title} has room for {most}")
            }
            CapacityError::Globals { globals, slots, .. } => format!(
                "{globals} globals need {} slots of memory, the {title} has {slots}",
                globals + BESIDE_GLOBALS
            ),
            CapacityError::Stack { path, globals, slots } => format!(
                "{path} needs {} slots of memory, {globals} of them for globals; the {title} has {slots}",
                globals + path.slots,
                path = CallChain { path, function }
            ),
        }
    }

    /// Returns advice how to make the script fit.
    pub fn help(&self) -> String {
        match self {
            CapacityError::Feature { name, .. } => {
                format!("leave `{name}` out of the script, or allow it in the [vm] of the robot file")
            }
            CapacityError::Part { .. } => {
                "build it with this script: `cargo xtask build ROBOT --script FILE`".to_owned()
            }
            CapacityError::Flash { .. } => {
                "leave out what this robot does not need; `if(name) { ... }` distinguishes robots"
                    .to_owned()
            }
            CapacityError::Globals { most, .. } => format!(
                "at most {most} fit; use local variables, or keep values in a table, which needs 7 slots for 6"
            ),
            CapacityError::Stack { .. } => {
                "fewer globals, fewer local variables in these functions, or fewer calls within calls"
                    .to_owned()
            }
        }
    }
}

/// Prints a chain of calls: `step() -> turn() -> measure()`.
struct CallChain<'a> {
    path: &'a CallPath,
    function: &'a dyn Fn(u16) -> String,
}

impl fmt::Display for CallChain<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        /// The maximum number of functions that are printed.
        const PRINTED_MAX: usize = 6;
        let name = |number: &u16| format!("`{}`", (self.function)(*number));
        let names: Vec<String> = match self.path.functions.as_slice() {
            [first @ .., last] if first.len() >= PRINTED_MAX => {
                let between = format!("{} more", self.path.functions.len() - PRINTED_MAX);
                let shown = first.iter().take(PRINTED_MAX - 1).map(name);
                shown.chain([between, name(last)]).collect()
            }
            all => all.iter().map(name).collect(),
        };
        f.write_str(&names.join(" -> "))
    }
}

/// Loads an image in the way that the robot would. Returns the error of its virtual machine if the
/// image is refused.
pub fn verify(image: &[u8], profile: NumberProfile, robot: &Robot) -> Result<(), ImageError> {
    match profile {
        NumberProfile::Tiny => load::<Tiny>(image, robot).map(drop),
        NumberProfile::Full => load::<Full>(image, robot).map(drop),
    }
}

/// Returns the image followed by its seal, with which that robot skips the verifier: see [`seal`].
/// Fails with the reason why a robot would refuse the image.
pub fn sealed(image: &[u8], robot: &Robot) -> Result<Vec<u8>, ImageError> {
    match robot.profile {
        NumberProfile::Tiny => sealed_for::<Tiny>(image, robot),
        NumberProfile::Full => sealed_for::<Full>(image, robot),
    }
}

/// Returns the bytes of an image as the script region of that robot holds them: with a seal if the
/// robot file says `script_sealed`. Fails with the reason why the robot would refuse a sealed image.
pub fn for_flash<'a>(image: &'a [u8], robot: &Robot) -> Result<Cow<'a, [u8]>, ImageError> {
    match robot.layout {
        Some(layout) if layout.script_sealed => sealed(image, robot).map(Cow::Owned),
        _ => Ok(Cow::Borrowed(image)),
    }
}

fn sealed_for<P: number::Profile>(image: &[u8], robot: &Robot) -> Result<Vec<u8>, ImageError> {
    let functions: Vec<u16> = robot.functions.iter().map(|function| function.hash()).collect();
    let left_out = if robot.vm.maths { 0 } else { Feature::Maths as u8 };
    let offered =
        seal::robot::<P>(features::<P>() & !left_out, robot.sizes(), robot.parts, &functions);
    let seal = load::<P>(image, robot)?.seal(offered).ok_or(ImageError::Seal)?;
    Ok([image, &seal].concat())
}

fn load<'a, P: number::Profile>(
    image: &'a [u8],
    robot: &Robot,
) -> Result<Machine<'a, P>, ImageError> {
    // The machine is too large for the stack of a thread.
    let mut vm: Machine<'a, P> = Box::new(Vm::new());
    // The sizes only need to allow loading, because [`lacking`] reports parts that the robot does
    // not have.
    vm.set_network_capacity(Sizes { neighbors: 1, bearings: false, entries: 1, swarms: 1 });
    let has_function = |hash| robot.functions.iter().any(|function| function.hash() == hash);
    vm.load_limited(Image::new(image), robot.vm.slots as usize, has_function)?;
    Ok(vm)
}
