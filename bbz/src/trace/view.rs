//! Shows a trace in a page.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::sync_channel;
use std::thread;
use std::time::Duration;

use bittybuzz_live::Watched;
use bittybuzz_page::Page;

use crate::exit::ExitStatus;
use crate::interrupt::Interrupt;
use crate::problem::Problem;
use crate::view::{self, Opening, ViewError};

use super::printer::TracePrinter;

/// The greatest number of reports that wait for the page's session, which takes them every few milliseconds.
const REPORTS_MAX: usize = 1024;

/// Time between two checks of the page after the last message.
const PATIENCE: Duration = Duration::from_millis(100);

/// Shows the messages of `listen` in a page until it is closed, or Ctrl-C. The page stays after the last message.
pub fn show(
    no_browser: bool,
    kind: &str,
    printer: TracePrinter<'_>,
    mut interrupt: Interrupt,
    listen: impl FnOnce(&mut TracePrinter<'_>, &mut Interrupt) -> Result<(), Box<dyn Problem>>,
) -> Result<ExitStatus, Box<dyn Problem>> {
    let page = Page::open().map_err(ViewError)?;
    let (sender, reports) = sync_channel(REPORTS_MAX);
    let is_closed = Arc::new(AtomicBool::new(false));
    let mut watched = Watched::new(reports, kind, printer.script_name());
    let mut printer = printer.for_page(sender, is_closed.clone());
    let mut opening = Opening::begin(page.url(), no_browser)?;
    let is_pressed = interrupt.flag();
    thread::scope(|scope| {
        let is_over = is_pressed.clone();
        let shown = scope.spawn(move || {
            let over = || {
                // The trace goes on if its page's address cannot be printed.
                let _ = opening.attend(page.was_opened());
                is_over.load(Ordering::Relaxed)
            };
            let shown = page.show(&mut watched, over, &view::advice());
            is_closed.store(true, Ordering::Relaxed);
            shown
        });
        let listened = listen(&mut printer, &mut interrupt);
        if listened.is_err() {
            // The command ends and prints this error.
            is_pressed.store(true, Ordering::Relaxed);
        }
        // Dropping the printer shows the page that no more messages follow.
        let ending = printer.finish();
        while !shown.is_finished() && !interrupt.is_raised() {
            interrupt.wait(PATIENCE);
        }
        let shown = shown.join().expect("`show` catches the panics of a session");
        listened?;
        let ending = ending?;
        Ok(match view::ending(shown) {
            ExitStatus::Success => ending,
            defect => defect,
        })
    })
}
