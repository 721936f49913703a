//! Changes of scripts, of the world at its beginning, and of the commands of the session.

use std::time::Duration;

use bittybuzz_arena::run::Session;

use super::{Live, NOT_EDITED, Seek};
use crate::by_hand::{self, BuiltText, WorldEdit};
use crate::changes::{self, Changes, Commands};
use crate::conditions;
use crate::edit::{self, EditError, NewRun};
use crate::pace::Pace;
use crate::page_event::{BuiltEvent, PageEvent};
use crate::reports::Reports;
use crate::request::Texts;
use crate::series::Series;
use crate::source::Source;
use crate::workshop::Drafts;

impl Live {
    /// Handles a request of the editor.
    pub(super) fn edit(
        &mut self,
        act: impl FnOnce(&mut Drafts, &mut Session) -> Result<Vec<PageEvent>, EditError>,
    ) {
        let Some(drafts) = &mut self.drafts else { return self.refuse(NOT_EDITED, None) };
        match act(drafts, &mut self.session) {
            Ok(events) => self.events.extend(events),
            Err(error) => self.refuse_edit(error),
        }
    }

    pub(super) fn refuse_edit(&mut self, error: EditError) {
        match error {
            EditError::Refused(reason) => self.refuse(&reason, None),
            EditError::Errors(names, found) => {
                self.events.extend(found.into_iter().map(PageEvent::Diagnostics));
                let names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
                let have = if names.len() == 1 { "has" } else { "have" };
                let names = names.join(" and ");
                let text = format!("{names} {have} errors: the robots go on with what they have");
                self.refuse(&text, None);
            }
            EditError::Misfit(found) => {
                // The editor may show a script, so the reason stands here, too.
                let reason = found.diagnostics.first().map_or("", |error| &error.message);
                let text = format!("`{}` does not fit the scripts: {reason}", found.name);
                self.events.push(PageEvent::Diagnostics(found));
                self.refuse(&text, None);
            }
            EditError::Command(errors) => {
                errors.iter().for_each(|error| self.refuse_command(error));
            }
        }
    }

    /// Undoes the last change of the commands, or does the next one again.
    pub(super) fn move_changes(&mut self, is_undo: bool, now: Duration) {
        let Some(commands) = self.changes.next(is_undo).cloned() else {
            let word = if is_undo { "undone" } else { "done again" };
            return self.refuse(&format!("there is no change that can be {word}"), None);
        };
        let present = changes::commands(self.session.run());
        if self.replace_commands(&commands, now) {
            self.changes.moved(is_undo, present);
            self.add_conditions_of(true);
        }
    }

    /// Replaces the commands, and goes to the present tick again. Returns false if it is refused.
    pub(super) fn replace_commands(&mut self, commands: &Commands, now: Duration) -> bool {
        let to = self.session.run().now();
        if let Err(reason) = self.session.replace_commands(commands) {
            self.refuse(&reason.to_string(), None);
            return false;
        }
        self.pace = Pace::Paused;
        if let Some(drafts) = &mut self.drafts {
            drafts.set_loaded(edit::loaded(self.session.run()));
        }
        let from = self.session.run().now();
        // The next turn goes there, and ends with the state.
        self.seek = Some(Seek { to, from, since: now, told: now, then: Vec::new() });
        true
    }

    /// Changes the world by hand, and starts the run again from the beginning.
    pub(super) fn build(&mut self, edit: &WorldEdit, mut texts: Texts, keep_changes: bool) {
        let Some(drafts) = &self.drafts else { return self.refuse(NOT_EDITED, None) };
        let name = edit::name_of_scenario(drafts, self.session.run().setup());
        if texts.get(&name).is_some_and(|text| *text != self.scenario) {
            let text = format!("`{name}` has not run as it is shown: press Run, then build");
            return self.refuse(&text, None);
        }
        let parse = |text: &str| drafts.workshop().parse(text, &[]);
        match by_hand::apply(&self.scenario, edit, &parse) {
            Ok(BuiltText { text, thing }) => {
                texts.insert(name, text.clone());
                let before = self.scenario.clone();
                if self.restart(&texts, keep_changes) {
                    let event = BuiltEvent { before, text, thing };
                    self.events.push(PageEvent::Built(event));
                }
            }
            Err(error) => self.refuse(&error.to_string(), error.help()),
        }
    }

    /// Starts the run again from the beginning. Returns false if it is refused.
    pub(super) fn restart(&mut self, texts: &Texts, keep_changes: bool) -> bool {
        let Some(drafts) = &mut self.drafts else {
            self.refuse(NOT_EDITED, None);
            return false;
        };
        let begun = drafts.all_begun().clone();
        let run = self.session.run();
        match edit::begin(drafts, run, &self.scenario, texts, keep_changes) {
            Ok(NewRun { run, scenario, events }) => {
                // With the same texts, the new run goes the way of the earlier one until commands differ.
                let programs = run.setup().programs().zip(self.session.run().setup().programs());
                let is_same = programs.into_iter().all(|(new, old)| new.image == old.image);
                if is_same && scenario == self.scenario && *drafts.all_begun() == begun {
                    let conditions = conditions::commands(&run);
                    if let Some(tick) = conditions::parting(&self.conditions.commands, &conditions)
                    {
                        self.series.cut(tick);
                    }
                } else {
                    self.series = Series::new(&run);
                }
                self.session = self.session.anew(run);
                self.changes = Changes::default();
                self.reports = Reports::default();
                self.session.keep_post_mortems();
                self.scenario = scenario;
                self.pace = Pace::Paused;
                self.seek = None;
                self.has_failed = false;
                // Events of the earlier run come before the one that clears the page.
                let before = std::mem::take(&mut self.events);
                self.begin();
                let begun = std::mem::replace(&mut self.events, before);
                self.events.append(begun);
                self.events.extend(events);
                true
            }
            Err(error) => {
                self.refuse_edit(error);
                false
            }
        }
    }
}
