//! A machine with its recorder.

use bittybuzz_vm_core::message::{Message, ScriptIdentity};
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{
    ByteCode, Entry, Fault, Image, ImageError, NetworkCounters, Outcome, Sizes, Vm, builtin,
};

use crate::frames::frame;
use crate::link::Received;
use crate::recorder::Recorder;

/// What a Kilobot remembers of other robots, and the bearings that only other robots know.
pub const SIZES: Sizes = Sizes { neighbors: 15, bearings: true, entries: 4, swarms: 8 };

/// What a robot on a computer remembers: an index finds so many entries.
pub const LARGE_SIZES: Sizes = Sizes { neighbors: 40, bearings: true, entries: 300, swarms: 8 };

/// Slots of a machine for [`LARGE_SIZES`], so many that it can pause.
pub const LARGE_SLOTS: usize = 6000;

/// A robot: a machine of `SLOTS` slots and the host that records it.
pub struct TestRobot<P: Profile, C: ByteCode = &'static [u8], const SLOTS: usize = 600> {
    /// The machine.
    pub vm: Box<Vm<P, C, SLOTS>>,
    /// The host.
    pub host: Recorder,
    /// Instructions of one slice.
    pub budget: u16,
    /// The id that it has after a restart.
    pub id: u16,
    /// The seed of its random numbers after a restart.
    pub seed: u32,
    /// Collections, and the sending of changes, go on in the next slice, as on a chip with much memory. The memory is
    /// audited at the end of an entry then, not after each slice.
    #[cfg(feature = "torture")]
    pauses: bool,
    /// The run-time error that stopped the script.
    pub fault: Option<Fault>,
    code: C,
    sizes: Sizes,
    has_begun: bool,
}

impl<P: Profile, C: ByteCode, const SLOTS: usize> TestRobot<P, C, SLOTS> {
    /// Loads an image.
    ///
    /// # Panics
    /// If the verifier refuses it.
    pub fn new(code: C, id: u16, sizes: Sizes) -> Self {
        Self::load(code, id, sizes)
            .unwrap_or_else(|error| panic!("the image is refused: {error:?}"))
    }

    /// Loads an image, unless the verifier refuses it.
    pub fn load(code: C, id: u16, sizes: Sizes) -> Result<Self, ImageError> {
        let mut robot = TestRobot {
            vm: Box::new(Vm::new()),
            host: Recorder::default(),
            budget: 1000,
            id,
            seed: 1,
            #[cfg(feature = "torture")]
            pauses: false,
            fault: None,
            code,
            sizes,
            has_begun: false,
        };
        robot.power_on()?;
        Ok(robot)
    }

    /// Lets a machine with much memory pause, see [`bittybuzz_vm_core::Torture::pauses_collections`].
    #[cfg(feature = "torture")]
    pub fn pause(&mut self) {
        self.pauses = true;
        self.vm.torture.pauses_collections = true;
    }

    fn power_on(&mut self) -> Result<(), ImageError> {
        *self.vm = Vm::new();
        #[cfg(feature = "torture")]
        {
            self.vm.torture.pauses_collections = self.pauses;
        }
        self.vm.set_network_capacity(self.sizes);
        self.vm.load(Image::new(self.code), |_| true)?;
        self.vm.set_robot_id(self.id, self.seed);
        (self.fault, self.has_begun) = (None, false);
        Ok(())
    }

    /// Switches the robot off and on: it knows nothing any more, but its recording goes on. Frames
    /// that wait stay; give the host another link if they are to be lost.
    pub fn restart(&mut self) {
        assert_eq!(self.power_on(), Ok(()), "the image was accepted before");
    }

    /// Makes the script ready to start again after a fault. Until [`TestRobot::start`] its steps
    /// handle messages only.
    pub fn rest(&mut self) {
        self.vm.restart();
        self.fault = None;
    }

    /// Runs global code and `init()` again.
    pub fn start(&mut self) -> Result<(), Fault> {
        self.has_begun = false;
        self.begin()
    }

    /// Runs one step, the first time after global code and `init()`. A script that stopped stays
    /// so.
    pub fn step(&mut self) -> Result<(), Fault> {
        self.begin()?;
        self.enter(Entry::Step)
    }

    /// Runs global code and `init()`, unless they have run.
    pub fn begin(&mut self) -> Result<(), Fault> {
        if self.has_begun {
            return self.fault.map_or(Ok(()), Err);
        }
        self.has_begun = true;
        self.enter(Entry::Global)?;
        self.enter(Entry::Init)
    }

    /// Runs an entry to its end, if the script has it.
    ///
    /// # Panics
    /// If it does not end within a million slices.
    pub fn enter(&mut self, entry: Entry) -> Result<(), Fault> {
        if let Some(fault) = self.fault {
            return Err(fault);
        }
        self.host.link.begin_step(self.vm.unwanted_topics());
        if !self.vm.begin(entry) {
            return Ok(());
        }
        for _ in 0..1_000_000 {
            let outcome = self.vm.run(&mut self.host, self.budget);
            #[cfg(feature = "torture")]
            if (!self.pauses || outcome == Outcome::Done)
                && let Err(problem) = self.vm.audit()
            {
                panic!("robot {}: {problem}", self.id);
            }
            match outcome {
                Outcome::Done => return Ok(()),
                Outcome::Fault(fault) => {
                    self.fault = Some(fault);
                    return Err(fault);
                }
                Outcome::Pending | Outcome::Waiting => {}
            }
        }
        panic!("robot {}: {entry:?} does not end", self.id);
    }

    /// Returns the script as messages know it.
    pub fn script(&self) -> ScriptIdentity {
        let header = self.vm.header().expect("an image is loaded");
        ScriptIdentity { hash: header.hash(), strings: header.strings() + builtin::string::COUNT }
    }

    /// Returns the frame of a message between robots of this script.
    ///
    /// # Panics
    /// If the message does not fit.
    pub fn frame(&self, message: &Message<'_, P>) -> Vec<u8> {
        frame(self.script(), message)
    }

    /// A message from outside waits for the robot.
    pub fn receive(&mut self, message: &Message<'_, P>) {
        let frame = self.frame(message);
        self.host.link.push(Received::new(&frame));
    }

    /// Takes the frames that the robot has sent.
    pub fn take_sent(&mut self) -> Vec<Vec<u8>> {
        std::iter::from_fn(|| self.host.link.pop_sent()).collect()
    }

    /// Returns the counters of messages that the robot could not use, since it was switched on.
    pub fn counters(&self) -> NetworkCounters {
        self.vm.counters()
    }
}
