//! Undo and redo of the session's commands.

use bittybuzz_arena::run::Simulation;

use crate::page_event::CommandDescription;

/// The commands of a run in their order: the tick before which each acts, and its text.
pub type Commands = Vec<(u64, String)>;

/// The greatest number of steps that can be undone.
const STEPS_MAX: usize = 100;

/// The lists of commands before and after the present one.
#[derive(Default)]
pub struct Changes {
    past: Vec<Commands>,
    /// The last one is the next.
    future: Vec<Commands>,
}

impl Changes {
    /// Records that another list of commands has taken the place of `before`.
    pub fn record(&mut self, before: &[CommandDescription]) {
        self.future.clear();
        let before = before.iter().map(|command| (command.tick, command.text.clone()));
        self.past.push(before.collect());
        if self.past.len() > STEPS_MAX {
            self.past.remove(0);
        }
    }

    pub fn can_undo(&self) -> bool {
        !self.past.is_empty()
    }

    pub fn can_redo(&self) -> bool {
        !self.future.is_empty()
    }

    /// Returns the commands before the last step, or after the one that was undone last.
    pub fn next(&self, is_undo: bool) -> Option<&Commands> {
        if is_undo { self.past.last() } else { self.future.last() }
    }

    /// Records that the session now has the commands that [`next`](Self::next) returned, instead of
    /// `present`.
    pub fn moved(&mut self, is_undo: bool, present: Commands) {
        let (from, to) = match is_undo {
            true => (&mut self.past, &mut self.future),
            false => (&mut self.future, &mut self.past),
        };
        from.pop();
        to.push(present);
    }
}

/// Returns the commands of a run.
pub fn commands(run: &Simulation) -> Commands {
    run.command_list().map(|(tick, text)| (tick, text.to_owned())).collect()
}
