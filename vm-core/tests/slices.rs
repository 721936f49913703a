//! Slices that end by the host's clock.

use bittybuzz_testkit::Program;
use bittybuzz_vm_core::number::Tiny;
use bittybuzz_vm_core::{
    Axis, ByteCode, CallArguments, Entry, Host, Image, Outcome, Reply, RobotFault, Value, Vm,
};

/// A robot that can do nothing, and lets the machine ask so often before a slice is over.
struct Clock<const IS_TIMED: bool> {
    questions: u32,
    left: u32,
}

impl<const IS_TIMED: bool> Host<Tiny> for Clock<IS_TIMED> {
    const IS_TIMED: bool = IS_TIMED;

    fn is_slice_over(&mut self) -> bool {
        self.questions += 1;
        match self.left.checked_sub(1) {
            Some(left) => self.left = left,
            None => return true,
        }
        false
    }

    fn call<C: ByteCode, const N: usize>(
        &mut self,
        _: u16,
        _: CallArguments<'_, Tiny, C, N>,
        _: bool,
    ) -> Result<Reply<Tiny>, RobotFault> {
        Ok(Reply::Value(Value::nil()))
    }

    fn log<C: ByteCode, const N: usize>(&mut self, _: CallArguments<'_, Tiny, C, N>) {}

    fn delay_is_over(&mut self, _: i32, _: bool) -> bool {
        true
    }

    fn position(&mut self, _: Axis) -> Option<f32> {
        None
    }
}

const LOOP: &str = "i = 0 while(i < 100) i = i + 1";
const TABLE: &str = "t = {} i = 0 while(i < 100) { t[i] = i i = i + 1 } i = size(t)";

/// Runs global code in slices of this budget, in each of which the host answers so many questions before the slice is
/// over. Returns the number of slices and of questions.
fn run<const IS_TIMED: bool>(script: &str, budget: u16, questions: u32) -> (u32, u32) {
    let program = Program::new::<Tiny>(script);
    let mut vm: Vm<Tiny, &[u8], 600> = Vm::new();
    vm.load(Image::new(program.image.as_slice()), |_| true).expect("the image is sound");
    let mut host: Clock<IS_TIMED> = Clock { questions: 0, left: 0 };
    assert!(vm.begin(Entry::Global));
    for slices in 1..1000 {
        host.left = questions;
        match vm.run(&mut host, budget) {
            Outcome::Pending => {}
            Outcome::Done => {
                let globals = &program.symbols.globals;
                let i = globals.iter().position(|name| name == "i").expect("a global");
                assert_eq!(vm.global(i as u16).and_then(|value| value.as_int()), Some(100));
                return (slices, host.questions);
            }
            other => panic!("{other:?}"),
        }
    }
    panic!("no end");
}

#[test]
fn a_fast_clock_is_read_before_each_instruction() {
    for script in [LOOP, TABLE] {
        let (slices, instructions) = run::<true>(script, 0, u32::MAX);
        assert_eq!(slices, 1);
        assert!(instructions > 300, "{instructions}");
        // Each slice ends with a question that is answered by yes.
        let (slices, questions) = run::<true>(script, 0, 10);
        assert_eq!(slices, instructions.div_ceil(10));
        assert_eq!(questions, instructions + slices - 1);
    }
}

#[test]
fn other_clocks_are_read_after_long_instructions() {
    // At the start of a slice, and after that never in time.
    let (slices, questions) = run::<false>(LOOP, u16::MAX, 1);
    assert!(slices <= 3 && questions <= 6, "{slices} {questions}");
    let (slices, _) = run::<false>(TABLE, u16::MAX, 1);
    assert!((101..110).contains(&slices), "{slices}");
    // Their budget ends slices, too.
    let (slices, _) = run::<false>(LOOP, 10, u32::MAX);
    assert!(slices > 30, "{slices}");
}
