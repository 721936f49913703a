//! Defects of the program itself: broken invariants, which stop the code that finds them.
//!
//! An impossible case panics with the reason why it is impossible. A boundary catches the panic, so
//! that it ends one run or one session instead of all. [`Defect`] is the message about it.

use std::any::Any;
use std::cell::RefCell;
use std::fmt;
use std::panic::{self, AssertUnwindSafe, PanicHookInfo};
use std::sync::{Mutex, Once, PoisonError};

/// A defect of `bbz`. The `Display` form is one line with version, place and message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Defect {
    /// The message of the panic: the invariant that does not hold.
    message: String,
    /// File and line of the source; `None` if the panic came from a thread without a boundary and
    /// another panic followed it.
    place: Option<String>,
}

thread_local! {
    /// The defect that the panic hook noted within the boundary of this thread; the outer `None`
    /// stands for no boundary.
    static CAUGHT: RefCell<Option<Option<Defect>>> = const { RefCell::new(None) };
}

/// The last defect of a thread without a boundary. A pool of threads passes the panic on to the
/// thread that waits for it, without the place.
static ELSEWHERE: Mutex<Option<Defect>> = Mutex::new(None);

impl Defect {
    fn new(panic: &PanicHookInfo<'_>) -> Defect {
        let place = panic.location().map(|place| format!("{}:{}", place.file(), place.line()));
        Defect { message: message(panic.payload()), place }
    }

    /// Calls `work` and returns its result, or the defect that stopped it. State that `work` has
    /// changed may be inconsistent after a defect, so the caller discards it.
    pub fn catch<T>(work: impl FnOnce() -> T) -> Result<T, Defect> {
        static HOOK: Once = Once::new();
        HOOK.call_once(|| {
            let outer = panic::take_hook();
            panic::set_hook(Box::new(move |panic| {
                if !note(panic) {
                    outer(panic);
                }
            }));
        });
        let outer = CAUGHT.replace(Some(None));
        let result = panic::catch_unwind(AssertUnwindSafe(work));
        let noted = CAUGHT.replace(outer).flatten();
        result.map_err(|payload| noted.unwrap_or_else(|| elsewhere(message(&*payload))))
    }

    /// Prints the defects that no boundary catches by `print`, instead of as panics of Rust. A
    /// program calls this once, before the first boundary.
    pub fn print_uncaught_by(print: fn(&Defect)) {
        panic::set_hook(Box::new(move |panic| print(&Defect::new(panic))));
    }

    /// Returns advice for the user; `command` repeats the defect.
    pub fn advice(command: &str) -> String {
        format!(
            "your files are not the cause; report the line above with this command, which \
             repeats it, and with the files that it reads: {command}"
        )
    }
}

impl fmt::Display for Defect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "defect of bbz {}", env!("CARGO_PKG_VERSION"))?;
        if let Some(place) = &self.place {
            write!(f, " at {place}")?;
        }
        write!(f, ": {}", self.message)
    }
}

impl std::error::Error for Defect {}

/// Keeps the place of a panic, which its payload does not have. Returns false if no boundary of
/// this thread will catch it.
fn note(panic: &PanicHookInfo<'_>) -> bool {
    let defect = Defect::new(panic);
    CAUGHT.with_borrow_mut(|caught| match caught {
        Some(noted) => {
            *noted = Some(defect);
            true
        }
        None => {
            *ELSEWHERE.lock().unwrap_or_else(PoisonError::into_inner) = Some(defect);
            false
        }
    })
}

/// Returns the defect of another thread that has this message.
fn elsewhere(message: String) -> Defect {
    let last = ELSEWHERE.lock().unwrap_or_else(PoisonError::into_inner).clone();
    let same = last.filter(|defect| defect.message == message);
    same.unwrap_or(Defect { message, place: None })
}

/// Returns the message of a panic on one line.
fn message(payload: &(dyn Any + Send)) -> String {
    let text = match (payload.downcast_ref::<&str>(), payload.downcast_ref::<String>()) {
        (Some(text), _) => text,
        (None, Some(text)) => text.as_str(),
        (None, None) => "a panic without a message",
    };
    text.lines().map(str::trim).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_defect_has_version_place_and_message() {
        let line = line!() + 1;
        let defect = Defect::catch(|| panic!("robot {} is\nmissing", 7)).unwrap_err();
        let version = env!("CARGO_PKG_VERSION");
        let expected =
            format!("defect of bbz {version} at live/src/defect.rs:{line}: robot 7 is missing");
        assert_eq!(defect.to_string().replace('\\', "/"), expected);
    }

    #[test]
    fn work_without_a_defect_returns_its_result() {
        assert_eq!(Defect::catch(|| 7), Ok(7));
    }

    #[test]
    fn a_boundary_within_a_boundary_catches_its_own_defects() {
        let outer = Defect::catch(|| {
            let inner = Defect::catch(|| panic!("inner"));
            assert_eq!(inner.unwrap_err().message, "inner");
            panic!("outer")
        });
        assert_eq!(outer.unwrap_err().message, "outer");
    }

    #[test]
    fn a_defect_of_another_thread_keeps_its_place() {
        let defect = Defect::catch(|| {
            let thread = std::thread::spawn(|| panic!("in a thread"));
            thread.join().map_err(panic::resume_unwind).unwrap();
        });
        let text = defect.unwrap_err().to_string();
        assert!(text.contains("live/src/defect.rs:"), "{text}");
        assert!(text.ends_with(": in a thread"), "{text}");
    }
}
