//! The machine: memory, program and registers, and the protocol by which a host drives it.
//!
//! # Frames
//! ```text
//! fp - n ... fp - 1   parameters (unset where the caller passed none)
//! fp                  record: distance to the caller's fp in the tag byte, return position in the payload
//! fp + 1 ...          hidden locals (closure, self), variables, operands
//! ```
//! The arguments of a call stay in their slots and become the parameters; a return puts the result
//! where the first parameter was. Built-ins that call script functions (`foreach`, ...) or wait
//! (`delay`) have frames too: their "return position" is one of the [`Native`] codes, at which the
//! interpreter resumes the built-in. Nothing therefore recurses on the stack of the processor, and
//! a run can stop between any two instructions.

#[cfg(feature = "torture")]
mod audit;
mod builtins;
mod call;
mod collection;
mod compare;
mod decode;
mod digest;
mod inspect;
mod interpret;
mod iterate;
mod library;
mod network;
mod question;
mod quick;
mod slow;
mod text;

use crate::arena::Arena;
use crate::bytecode::ByteCode;
use crate::fault::{Fault, FaultCode, Stopped};
use crate::host::Host;
use crate::image::{Entry, EntryPoint, Image, ImageError, ImageHeader, Verified};
use crate::number::{Profile, Rng, TextWork};
use crate::part::Part;
use crate::seal::{self, SealedImage};
use crate::value::{Tag, Type, Value};
use crate::verify;
pub use inspect::{
    Activity, CallFrame, CallFrames, Callee, ClosureParts, FramePlace, Instruction, TableEntries,
    ValueKind,
};
use network::Protocol;
pub use network::{KnownSwarm, Neighbor, StoredEntry, Trigger};
pub use quick::QuickLoop;

/// The slot of the machine's own global: the table of the changes that the script made to libraries
/// (see [`library`]), and of its listeners and handlers.
const OVERLAYS: usize = 0;
/// Slot of global 0.
pub const GLOBALS: usize = 1;
/// The number of slots above its record that a built-in's frame may use, including those for the
/// arguments of callbacks.
const NATIVE_ROOM: usize = 12;
/// The first return position that stands for the machine itself: no image is that long.
const SPECIAL: usize = 0xff80;

/// A return position that stands for the machine itself: the number of a built-in of kind `Calls`,
/// or one of the constants below, which are not numbers of built-ins.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Native(u8);

impl Native {
    /// Calls the value of an entry, which is on top of the stack.
    const START: Native = Native(0x7d);
    const ROBOT: Native = Native(0x7e);
    /// Handles received messages before `step()`.
    const MESSAGES: Native = Native(0x7c);
    /// Copies a library to a table, see [`Vm::begin_copy`].
    const COPY: Native = Native(0x7b);
    const EXIT: Native = Native(0x7f);

    #[hot]
    fn position(self) -> usize {
        SPECIAL | self.0 as usize
    }
}

/// Read access to the script's memory and image.
pub(crate) struct MemoryView<'a, P: Profile, C: ByteCode, const SLOTS: usize> {
    pub(crate) arena: &'a Arena<P, C::Slots<P, SLOTS>>,
    program: Option<Verified<'a, C>>,
}

// Derived, these would need slots that can be copied.
impl<P: Profile, C: ByteCode, const SLOTS: usize> Copy for MemoryView<'_, P, C, SLOTS> {}

impl<P: Profile, C: ByteCode, const SLOTS: usize> Clone for MemoryView<'_, P, C, SLOTS> {
    fn clone(&self) -> Self {
        *self
    }
}

/// The end of a run.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Outcome {
    /// The budget is used up; run again.
    Pending,
    /// The script waits for `delay` or a robot function; run again at a later time.
    Waiting,
    /// The entry returned.
    Done,
    /// A fault stopped the script. It runs again only after it is loaded again, or after
    /// [`Vm::restart`] and a new start.
    Fault(Fault),
}

#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
// `repr(u8)` gives the state a tag byte of its own, in which `Empty` is 0. Otherwise the compiler
// would put the tag into unused values of the fault, and `Empty` would not be all zeros.
#[repr(u8)]
enum VmState {
    /// No program.
    Empty = 0,
    /// Ready for an entry.
    Idle,
    /// An entry runs.
    Running,
    /// Stopped by this fault.
    Faulted(Fault),
    /// The script was stopped, uses no network, and has no steps until it starts again.
    Resting,
}

/// A virtual machine with `SLOTS` slots of memory for one script. A clone continues exactly as the
/// original would.
#[repr(C)]
#[derive(Clone)]
pub struct Vm<P: Profile, C: ByteCode, const SLOTS: usize> {
    /// Position of the next instruction, or that of a [`Native`].
    pc: u16,
    /// Slot of the running frame's record.
    fp: u16,
    /// First slot above the operands.
    sp: u16,
    robot_id: u16,
    rng: Rng,
    state: VmState,
    /// The time that work on text took, in instructions, and that is not yet taken from the budget.
    work: P::TextWork,
    /// The failures that tests add to allocations.
    #[cfg(feature = "torture")]
    pub torture: crate::torture::Torture,
    /// The image of the program.
    code: Option<C>,
    header: ImageHeader,
    /// The first slot of the network: neighbors, entries, stigmergies, swarms.
    network_base: u16,
    /// True if the script uses neighbors, swarms or stigmergies.
    uses_network: bool,
    protocol: Protocol,
    // Last, so that the AVR reaches the other fields with short instructions.
    arena: Arena<P, C::Slots<P, SLOTS>>,
}

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Returns a machine without a program, for robot 0. It is all zeros, so that a static machine
    /// takes no flash and nothing has to be copied.
    pub const fn new() -> Self {
        Vm {
            arena: Arena::new(),
            code: None,
            header: ImageHeader::EMPTY,
            network_base: 0,
            uses_network: false,
            protocol: Protocol::EMPTY,
            pc: 0,
            fp: 0,
            sp: 0,
            robot_id: 0,
            rng: Rng::ZERO,
            state: VmState::Empty,
            work: P::TextWork::NONE,
            #[cfg(feature = "torture")]
            torture: crate::torture::Torture::NONE,
        }
    }

    /// Returns true if the machine has that part. The compiler knows the result.
    #[hot]
    const fn has(part: Part) -> bool {
        C::PARTS.has(part)
    }

    /// True if functions may be bound to the table or object from which they are read.
    const HAS_BOUND_METHODS: bool = Self::has(Part::Closures) || Self::has(Part::Libraries);

    /// Returns the program. With [`ByteCode::ONLY`] it is there before it is loaded, but then the
    /// machine does not run.
    #[hot]
    fn program(&self) -> Option<Verified<'_, C>> {
        let code = C::ONLY.or(self.code)?;
        Some(Verified { code, header: &self.header })
    }

    /// Returns the parts that a host may inspect.
    fn view(&self) -> MemoryView<'_, P, C, SLOTS> {
        MemoryView { arena: &self.arena, program: self.program() }
    }

    /// Verifies an image and makes it the program, with all memory empty. `is_robot_function`
    /// returns true if the robot has a function with that name hash. On an error there is no
    /// program.
    pub fn load(
        &mut self,
        image: Image<C>,
        is_robot_function: impl Fn(u16) -> bool,
    ) -> Result<(), ImageError> {
        self.load_limited(image, SLOTS, is_robot_function)
    }

    /// Like [`Vm::load`], but uses only the first `slots` slots. Tools use it to find out how much
    /// memory a script needs.
    pub fn load_limited(
        &mut self,
        image: Image<C>,
        slots: usize,
        is_robot_function: impl Fn(u16) -> bool,
    ) -> Result<(), ImageError> {
        let offered = verify::within(verify::features_of::<P>(C::PARTS), *self.sizes());
        self.take(image.code, slots, |header, arena| {
            header.read(&image.code)?;
            Verified { code: image.code, header }.verify(arena, offered, is_robot_function)
        })
    }

    /// Makes a sealed image the program. The image was verified where it was built, so the robot
    /// needs no verifier; see [`seal`]. `robot` is the constant that [`seal::robot`] returns for
    /// this robot.
    #[inline]
    pub fn load_sealed(&mut self, image: SealedImage<C>, robot: u16) -> Result<(), ImageError> {
        self.take(image.code, SLOTS, |header, arena| image.open(header, robot, arena.top() as u16))
    }

    /// Returns the seal of the program, to be appended to the image, for robots that have the
    /// memory of this machine and for which [`seal::robot`] returns `robot`. Returns `None` without
    /// a program.
    pub fn seal(&self, robot: u16) -> Option<[u8; seal::LENGTH]> {
        Some(self.loaded()?.seal(robot, self.arena.top() as u16))
    }

    /// Makes `code` the program if `check`, which reads its header, accepts it.
    #[hot]
    fn take(
        &mut self,
        code: C,
        slots: usize,
        check: impl FnOnce(
            &mut ImageHeader,
            &mut Arena<P, C::Slots<P, SLOTS>>,
        ) -> Result<(), ImageError>,
    ) -> Result<(), ImageError> {
        self.code = None;
        self.state = VmState::Empty;
        // A script that stopped may have left some work.
        self.work = P::TextWork::NONE;
        let others = self.sizes().slots();
        let slots = slots.min(SLOTS.saturating_sub(others));
        self.arena.reset(slots);
        // The header is read in place: a copy would cost the AVR more than the verifier's tables.
        let checked = check(&mut self.header, &mut self.arena);
        self.reset_network();
        let base = GLOBALS + usize::from(self.header.globals());
        // The slots of the network lie above the memory of the script.
        self.network_base = slots as u16;
        let at = self.network_base();
        self.arena.fill(at, at + others);
        self.arena.reset(slots);
        checked?;
        self.code = Some(code);
        self.arena.reserved = base as u16;
        self.fp = base as u16;
        self.sp = base as u16;
        self.state = VmState::Idle;
        Ok(())
    }

    /// Returns the header of the program; `None` if none is loaded.
    pub fn header(&self) -> Option<&ImageHeader> {
        self.loaded().map(|program| program.header())
    }

    /// Returns the program if it is loaded.
    fn loaded(&self) -> Option<Verified<'_, C>> {
        if self.state == VmState::Empty { None } else { self.program() }
    }

    /// Sets the id that scripts see, and seeds `rand` and `math.rng` from the seed of the run and
    /// this id.
    pub fn set_robot_id(&mut self, robot_id: u16, seed: u32) {
        self.robot_id = robot_id;
        self.rng = Rng::new(seed, robot_id);
        self.identify_network(robot_id);
    }

    /// Starts an entry, which [`Vm::run`] then runs. Returns false if the script does not have it,
    /// or cannot run now.
    pub fn begin(&mut self, entry: Entry) -> bool {
        self.end_pause();
        let is_restart = entry == Entry::Global && self.state == VmState::Resting;
        let Some(program) = self.program() else { return false };
        if self.state != VmState::Idle && !is_restart {
            return false;
        }
        let point = program.header.entry(entry);
        self.arena.leave_room_for_calls(self.sp.into());
        if entry == Entry::Global {
            self.end_rest();
        }
        if entry == Entry::Step && Self::HAS_NETWORK && self.uses_network {
            let is_there = self.protocol.is_resting || !self.entry_value(point).is_nil();
            if is_there {
                self.begin_messages();
            }
            return is_there;
        }
        if self.enter_function(point, usize::from(self.sp)) {
            self.state = VmState::Running;
            return true;
        }
        let callee = self.entry_value(point);
        self.begin_value(callee)
    }

    /// Returns the function that an entry calls.
    #[one_copy]
    fn entry_value(&self, point: EntryPoint) -> Value<P> {
        match point {
            EntryPoint::None => Value::nil(),
            EntryPoint::Global(number) => self.arena.get(GLOBALS + usize::from(number)),
            EntryPoint::Function(number) => Value::indexed(Tag::FUNCTION, number),
        }
    }

    /// Enters the usual kind of entry, a function without parameters for which there is room: makes
    /// it the outermost frame, at `base`. Returns false and changes nothing in all other cases.
    fn enter_function(&mut self, point: EntryPoint, base: usize) -> bool {
        let (EntryPoint::Function(number), Some(program)) = (point, self.program()) else {
            return false;
        };
        let function = program.function(number);
        let limit = base + 1 + usize::from(program.code.byte(function + 1));
        let fits = program.code.byte(function) == 0 && limit <= usize::from(self.arena.bottom);
        if fits {
            self.arena.reserved = limit as u16;
            self.arena.set_fast(base, record(0, Native::EXIT.position()));
            self.sp = base as u16 + 1;
            self.pc = function as u16 + 2;
        }
        fits
    }

    /// Starts an entry that calls any value. Returns false if the value is nil.
    #[one_copy]
    fn begin_value(&mut self, callee: Value<P>) -> bool {
        if callee.is_nil() {
            return false;
        }
        self.state = VmState::Running;
        self.pc = Native::EXIT.position() as u16;
        // A fault is reported by the next run.
        let base = usize::from(self.sp);
        if self.ensure(base + 1 + NATIVE_ROOM).is_ok() {
            self.push(record(0, Native::EXIT.position()));
            self.push(callee);
            self.pc = Native::START.position() as u16;
        }
        true
    }

    /// Runs at most `budget` instructions. A collection of garbage that is running takes its steps
    /// from the budget, too.
    pub fn run<H: Host<P>>(&mut self, host: &mut H, budget: u16) -> Outcome {
        let mut budget = budget;
        if self.is_paused() {
            match self.go_on(host, budget) {
                Ok(left) => budget = left,
                Err(outcome) => return outcome,
            }
        }
        let flow = if self.state == VmState::Running {
            self.interpret(host, budget)
        } else {
            Err(Stopped)
        };
        match flow {
            Ok(Flow::Done) => {
                self.finish();
                if self.pauses() {
                    return self.end_in_slices();
                }
                self.send_changes(host);
                Outcome::Done
            }
            Ok(Flow::Waiting) => Outcome::Waiting,
            Ok(Flow::Continue) => Outcome::Pending,
            Err(Stopped) => self.stopped(),
        }
    }

    /// Makes the script ready to start again after a fault, with [`Entry::Global`]: its globals are
    /// nil and its listeners are gone. The machine keeps neighbors, stigmergies with their clocks,
    /// the state of the random numbers and the counters, and leaves all swarms.
    ///
    /// Until the global code begins, a step handles messages and nothing else: the robot still
    /// sends beacons, and merges and relays entries. There is no such step without a program, nor
    /// for a script that uses no network.
    pub fn restart(&mut self) {
        if self.state == VmState::Empty {
            return;
        }
        self.end_pause();
        let base = GLOBALS + usize::from(self.header.globals());
        self.arena.fill(OVERLAYS, base);
        self.fp = base as u16;
        self.sp = base as u16;
        self.state = VmState::Resting;
        self.work = P::TextWork::NONE;
        self.rest_network();
        self.collect();
        // Cells do not move, so a cell of an entry may lie where the frame for messages has to be.
        // Without long messages no entry has cells.
        if Self::has(Part::LongMessages) && usize::from(self.arena.bottom) < base + 1 + NATIVE_ROOM
        {
            self.forget_entries_on_heap();
            self.collect();
        }
    }

    fn stopped(&self) -> Outcome {
        match self.state {
            VmState::Faulted(fault) => Outcome::Fault(fault),
            _ => Outcome::Done,
        }
    }

    /// Reads a global, for the host.
    pub fn global(&self, number: u16) -> Option<Value<P>> {
        let count = self.header()?.globals();
        if number < count { Some(self.arena.get(GLOBALS + usize::from(number))) } else { None }
    }

    /// Sets a global to a number, for the host. Returns false and changes nothing if there is no
    /// such global or the value is no number.
    pub fn set_global(&mut self, number: u16, value: Value<P>) -> bool {
        let is_number = value.as_int().is_some() || value.as_f32().is_some();
        let is_set = is_number && self.global(number).is_some();
        if is_set {
            self.arena.set(GLOBALS + usize::from(number), value);
        }
        is_set
    }

    /// Returns the calls that are running, innermost first. Each is the offset, from the start of
    /// the code, of the last byte of the instruction that its function executes.
    pub fn calls(&self) -> Calls<'_, P, C, SLOTS> {
        // Between entries no call is running, although `pc` keeps the position at which the loop
        // ended.
        let is_running = !matches!(self.state, VmState::Empty | VmState::Idle | VmState::Resting);
        let pc = if !is_running { Native::EXIT.position() } else { usize::from(self.pc) };
        Calls { vm: self, pc, fp: usize::from(self.fp) }
    }

    /// Leaves the entry's frame. Collects if the entry allocated and less than a quarter of the
    /// memory above the globals is unused.
    fn finish(&mut self) {
        self.state = VmState::Idle;
        // The outermost frame began at the first slot of the stack.
        self.sp = self.fp;
        if self.arena.allocated {
            let base = usize::from(self.fp);
            self.arena.reserved = self.fp;
            if self.arena.unused() < (self.arena.top() - base) / 4 {
                if self.pauses() {
                    self.begin_collection();
                } else {
                    self.collect();
                }
            }
        }
    }

    /// Frees all cells that the script cannot reach.
    #[one_copy]
    fn collect(&mut self) {
        if self.pauses() {
            return self.collect_at_once();
        }
        let (mut pc, mut fp) = (usize::from(self.pc), usize::from(self.fp));
        let mut slot = usize::from(self.sp);
        // While changed entries are sent, the outermost frame is left already, so no slot of the
        // stack holds a record.
        if self.state == VmState::Idle {
            fp = slot;
        }
        let mut reserved = slot;
        self.mark_entries();
        while slot > OVERLAYS {
            slot -= 1;
            let value = self.arena.get(slot);
            if slot == fp {
                // The record of a frame, which is no value.
                reserved = reserved.max(fp + 1 + self.frame_room(pc));
                (pc, fp) = self.caller(fp);
            } else {
                self.arena.mark(value);
            }
        }
        self.arena.reserved = reserved as u16;
        self.arena.sweep();
        self.arena.allocated = false;
    }

    /// Returns the position at which the caller of the frame at `fp` continues, and its frame.
    #[one_copy]
    fn caller(&self, fp: usize) -> (usize, usize) {
        let record = self.arena.get_fast(fp);
        (record.index(), fp.wrapping_sub(usize::from(record.tag().byte())))
    }

    /// Slots above the record that the frame running at `pc` may use.
    fn frame_room(&self, pc: usize) -> usize {
        match self.program() {
            Some(program) if pc < SPECIAL => {
                usize::from(program.code.byte(program.function_at(pc) + 1))
            }
            _ => NATIVE_ROOM,
        }
    }

    /// Makes sure that the stack may grow up to slot `limit`.
    #[one_copy]
    fn ensure(&mut self, limit: usize) -> Result<(), Stopped> {
        if limit > usize::from(self.arena.bottom) {
            self.want_repeat()?;
            self.collect();
            if limit > usize::from(self.arena.bottom) {
                return Err(self.fail(FaultCode::StackOverflow));
            }
        }
        self.arena.reserved = self.arena.reserved.max(limit as u16);
        Ok(())
    }

    /// Stops the script at the instruction before `pc`, with a fault that names no types of
    /// operands.
    #[one_copy]
    fn fail(&mut self, code: FaultCode) -> Stopped {
        self.fail_with(code, [Type::Nil; 2], 0)
    }

    /// Stops the script with a fault that concerns one or two values.
    #[one_copy]
    fn fail_on(&mut self, code: FaultCode, first: Value<P>, second: Value<P>) -> Stopped {
        // A missing argument is a fault of its own, whatever the operation.
        if first.is(Tag::UNSET) || second.is(Tag::UNSET) {
            return self.fail(FaultCode::MissingArgument);
        }
        self.fail_with(code, [first.type_of(), second.type_of()], 0)
    }

    fn wrong_type(&mut self, first: Value<P>, second: Value<P>) -> Stopped {
        self.fail_on(FaultCode::WrongType, first, second)
    }

    #[one_copy]
    fn fail_with(&mut self, code: FaultCode, operands: [Type; 2], detail: u16) -> Stopped {
        let position = self.calls().next().unwrap_or(0);
        self.state = VmState::Faulted(Fault { code, position, operands, detail });
        Stopped
    }
}

impl<P: Profile, C: ByteCode, const SLOTS: usize> Default for Vm<P, C, SLOTS> {
    fn default() -> Self {
        Self::new()
    }
}

/// The next action of the interpreter.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Flow {
    Continue,
    Waiting,
    Done,
}

/// Returns the record of a frame that is `delta` slots above its caller's frame.
#[hot]
fn record<P: Profile>(delta: usize, position: usize) -> Value<P> {
    Value::indexed(Tag::of(delta as u8), position as u16)
}

/// See [`Vm::calls`].
pub struct Calls<'a, P: Profile, C: ByteCode, const SLOTS: usize> {
    vm: &'a Vm<P, C, SLOTS>,
    pc: usize,
    fp: usize,
}

impl<'a, P: Profile, C: ByteCode, const SLOTS: usize> Calls<'a, P, C, SLOTS> {
    /// Returns the machine, for hosts that inspect it when a fault ends a listener.
    pub fn machine(&self) -> &'a Vm<P, C, SLOTS> {
        self.vm
    }
}

impl<P: Profile, C: ByteCode, const SLOTS: usize> Iterator for Calls<'_, P, C, SLOTS> {
    type Item = u16;

    fn next(&mut self) -> Option<u16> {
        let program = self.vm.program()?;
        loop {
            let pc = self.pc;
            if pc == Native::EXIT.position() {
                return None;
            }
            (self.pc, self.fp) = self.vm.caller(self.fp);
            // The frames of built-ins are not the script's.
            if pc < SPECIAL {
                let last_byte = pc.wrapping_sub(1 + usize::from(program.header().code_at()));
                return Some(last_byte as u16);
            }
        }
    }
}
