//! A trace in a page.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::thread;
use std::time::Duration;

use bittybuzz_live::Watched;
use bittybuzz_page::Page;

use crate::Ending;
use crate::interrupt::Interrupt;
use crate::problem::Problem;
use crate::view;

use super::teller::Teller;

/// Time between two looks at the page after the last message.
const PATIENCE: Duration = Duration::from_millis(100);

/// Shows the messages of `listen` in a page until it is closed, or Ctrl-C. The page stays after the last message.
pub fn show(
    no_browser: bool,
    kind: &str,
    teller: Teller<'_>,
    mut interrupt: Interrupt,
    listen: impl FnOnce(&mut Teller<'_>, &mut Interrupt) -> Result<(), Problem>,
) -> Result<Ending, Problem> {
    let page = Page::open().map_err(Problem::Page)?;
    let (sender, reports) = channel();
    let is_closed = Arc::new(AtomicBool::new(false));
    let mut watched = Watched::new(reports, kind, teller.script_name());
    let mut teller = teller.for_page(sender, is_closed.clone());
    view::announce(&page, no_browser)?;
    let is_pressed = interrupt.flag();
    thread::scope(|scope| {
        let is_over = is_pressed.clone();
        let shown = scope.spawn(move || {
            page.show(&mut watched, || is_over.load(Ordering::Relaxed));
            is_closed.store(true, Ordering::Relaxed);
        });
        let listened = listen(&mut teller, &mut interrupt);
        if listened.is_err() {
            // The command ends with its message.
            is_pressed.store(true, Ordering::Relaxed);
        }
        // The page learns that nothing more comes.
        let ending = teller.finish();
        while !shown.is_finished() && !interrupt.is_raised() {
            interrupt.wait(PATIENCE);
        }
        listened.and(ending)
    })
}
