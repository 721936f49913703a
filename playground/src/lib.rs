//! The compiler, the machine and the arena as one WebAssembly module. A scenario runs in a web page
//! exactly as in a native program.
//!
//! # Principles
//! 1. **The same run, bit for bit**: after any number of ticks the digest is that of a native run. CI compares them.
//! 2. **No imports**: `WebAssembly.instantiate(bytes, {})` is enough, so that the module also runs in a worker or in node.
//! 3. **No pointers from the page**: text goes through one buffer of the module, and the page reads
//!    and writes nothing else.
//!
//! # Use
//! A page writes each file with [`input`] and [`add_file`] and starts a scenario with [`start`].
//! Then it writes a request, calls [`request`], and calls [`advance`] as time passes.
//! [`take_events`] and [`take_sample`] leave their result in a buffer, which [`output`] and
//! [`output_length`] locate. The crate `bittybuzz-live` describes requests, events and samples.
//! `tests/run.mjs` does all of this.
//!
//! # Cost
//! The module of `cargo xtask site` takes 2.6 MB, and 0.7 MB as it is downloaded.
//!
//! # Limits
//! The module does not draw, cannot run robots in emulators, and has a single thread.

use std::cell::RefCell;
use std::time::Duration;

use bittybuzz_arena::run::Session;
use bittybuzz_live::{Live, PageEvent, SharedFiles, Shelf, Source};

/// The number of copies of a run that are kept to go back in time. A page has some gigabytes, and a
/// run of 20,000 robots takes 60 MB.
const COPIES: usize = 20;

/// The state of the module.
#[derive(Default)]
struct Playground {
    /// The files of the page, from which commands of a run load scripts.
    files: SharedFiles,
    live: Option<Live>,
    /// Bytes that the page writes.
    input: Vec<u8>,
    /// Bytes that the page reads.
    output: Vec<u8>,
}

thread_local! {
    static PLAYGROUND: RefCell<Playground> = RefCell::default();
}

impl Playground {
    /// Stores the input as a file: the first `name_length` bytes are its name, the others its text.
    fn add_file(&mut self, name_length: usize) {
        let (name, text) = self.input.split_at(name_length.min(self.input.len()));
        let name = String::from_utf8_lossy(name).into_owned();
        self.files.add(name, text);
    }

    /// Starts the scenario whose path is the input. On failure, the output is the error message.
    fn start(&mut self) -> bool {
        let path = String::from_utf8_lossy(&self.input).into_owned();
        let shelf = Shelf::new(self.files.clone(), path.into());
        self.output.clear();
        self.live = match shelf.open(1) {
            Ok((run, text)) => {
                let live = Live::new(Session::new(run, COPIES), text);
                Some(live.with_workshop(shelf))
            }
            Err(error) => {
                self.output = error.into_bytes();
                None
            }
        };
        self.live.is_some()
    }

    /// Executes the request that is the input.
    fn request(&mut self, now: Duration) {
        if let Some(live) = &mut self.live {
            live.request(&String::from_utf8_lossy(&self.input), now);
        }
    }

    /// Simulates at most `ticks_max` of the ticks that are due. Returns true if some are still due.
    fn advance(&mut self, now: Duration, ticks_max: u32) -> bool {
        let mut ticks = 0..ticks_max;
        let mut has_time = || ticks.next().is_some();
        self.live.as_mut().is_some_and(|live| live.advance(now, &mut has_time))
    }

    /// Sets the output to the events since the last call, as a JSON array.
    fn take_events(&mut self) {
        // Without a run there are no events.
        let events = self.live.as_mut().map(Source::take_events).unwrap_or_default();
        let events: Vec<String> = events.iter().map(PageEvent::to_json).collect();
        self.output = format!("[{}]", events.join(",")).into_bytes();
    }

    /// Sets the output to a sample.
    fn take_sample(&mut self) {
        // Without a run the sample is empty.
        self.output = self.live.as_mut().map(Source::take_sample).unwrap_or_default();
    }
}

/// Converts a time on the page's clock.
fn time(milliseconds: f64) -> Duration {
    // A negative time, which no clock of a page has, counts as its start.
    Duration::try_from_secs_f64(milliseconds / 1000.0).unwrap_or_default()
}

/// Calls `act` with the state of the module. The state is never borrowed twice, because nothing in
/// the module calls one of its exported functions.
fn with<T>(act: impl FnOnce(&mut Playground) -> T) -> T {
    PLAYGROUND.with_borrow_mut(act)
}

// SAFETY: of all exported functions, here and below: no other function of the module has these names.

/// Makes room for `length` bytes of input and returns their address, which is valid until the next
/// call. The page writes the input there.
#[unsafe(no_mangle)]
pub extern "C" fn input(length: usize) -> *mut u8 {
    with(|playground| {
        playground.input = vec![0; length];
        playground.input.as_mut_ptr()
    })
}

/// Adds a file, or replaces it: the first `name_length` bytes of the input are its path, the others its text.
#[unsafe(no_mangle)]
pub extern "C" fn add_file(name_length: usize) {
    with(|playground| playground.add_file(name_length));
}

/// Starts the scenario whose path is the input. Returns 1; on failure returns 0 and sets the output
/// to the error message.
#[unsafe(no_mangle)]
pub extern "C" fn start() -> u32 {
    with(|playground| playground.start().into())
}

/// Executes the request that is the input. `now` is the time on the page's clock in ms, which never
/// goes back.
#[unsafe(no_mangle)]
pub extern "C" fn request(now: f64) {
    with(|playground| playground.request(time(now)));
}

/// Simulates the ticks of 100 ms that are due, but at most `ticks_max`. Returns 1 if some are still due, else 0.
#[unsafe(no_mangle)]
pub extern "C" fn advance(now: f64, ticks_max: u32) -> u32 {
    with(|playground| playground.advance(time(now), ticks_max).into())
}

/// Sets the output to the events since the last call, as a JSON array.
#[unsafe(no_mangle)]
pub extern "C" fn take_events() {
    with(Playground::take_events);
}

/// Sets the output to a sample.
#[unsafe(no_mangle)]
pub extern "C" fn take_sample() {
    with(Playground::take_sample);
}

/// Returns the number of ticks that have passed; 0 without a run.
#[unsafe(no_mangle)]
pub extern "C" fn tick() -> f64 {
    // A page has no integers of 64 bits; a float is exact for 28 million years.
    with(|playground| playground.live.as_ref().map_or(0, |live| live.session().run().now()) as f64)
}

/// Returns the digest of the run; 0 without one.
#[unsafe(no_mangle)]
pub extern "C" fn digest() -> u64 {
    with(|playground| playground.live.as_ref().map_or(0, |live| live.session().run().digest()))
}

/// Returns the address of the output of the last call, which is valid until the next call. Text is
/// UTF-8.
#[unsafe(no_mangle)]
pub extern "C" fn output() -> *const u8 {
    with(|playground| playground.output.as_ptr())
}

/// Returns the length of the output in bytes.
#[unsafe(no_mangle)]
pub extern "C" fn output_length() -> usize {
    with(|playground| playground.output.len())
}
