//! Texts that a client typed and did not save, which survive the end of the session.

use std::path::Path;

use bittybuzz_arena::run::Setup;

use crate::edit;
use crate::page_event::UnsavedText;
use crate::workshop::Drafts;

/// A store of unsaved texts, which the next session of the same files offers.
pub trait UnsavedStore {
    /// Begins for another client: it is offered all texts that were kept until now.
    fn begin(&mut self);

    /// Returns the texts of a file that earlier clients left, oldest first. A text that equals
    /// `saved`, the text of the file, is forgotten.
    fn offers(&mut self, file: &Path, saved: &str) -> Vec<KeptText>;

    /// Keeps the text of this client in the place of its text before. Other clients' equal texts of
    /// the file are forgotten. `over` is the SHA-256 of the text in the file that was changed.
    /// Without a text, nothing of this client is kept. An error is a text for users.
    fn keep(&mut self, file: &Path, over: &str, text: Option<&str>) -> Result<(), String>;

    /// Forgets a text that was offered.
    fn discard(&mut self, id: &str);
}

/// A text in a store.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeptText {
    pub id: String,
    /// The time at which it was kept, in seconds since 1970.
    pub seconds: u64,
    /// SHA-256 of the text in the file that was changed, in hexadecimal.
    pub over: String,
    pub text: String,
}

/// The unsaved texts of a session.
#[derive(Default)]
pub struct Unsaved {
    store: Option<Box<dyn UnsavedStore>>,
    /// True after a text could not be kept. Only the first failure is reported: the next text
    /// follows within a second.
    has_failed: bool,
}

impl Unsaved {
    /// Returns the unsaved texts of a session with a store.
    pub fn new(store: impl UnsavedStore + 'static) -> Self {
        Unsaved { store: Some(Box::new(store)), has_failed: false }
    }

    /// Begins for another client and returns what it is offered. `opened` is the text of the scenario
    /// with which the session was opened.
    pub fn begin(&mut self, drafts: &Drafts, setup: &Setup, opened: &str) -> Vec<UnsavedText> {
        let Some(store) = &mut self.store else { return Vec::new() };
        store.begin();
        let mut names = edit::names(setup);
        names.push(edit::name_of_scenario(drafts, setup));
        let mut offered = Vec::new();
        for name in names {
            // A file that cannot be read any more has no text.
            let Ok((file, saved)) = edit::saved(drafts, setup, &name, opened) else { continue };
            let saved = saved.unwrap_or_default();
            let sha256 = crate::sha256(&saved);
            offered.extend(store.offers(&file, &saved).into_iter().map(|kept| UnsavedText {
                id: kept.id,
                name: name.clone(),
                file: file.display().to_string(),
                seconds: kept.seconds,
                changed: kept.over != sha256,
                text: kept.text,
            }));
        }
        offered
    }

    /// Keeps a text of the client, or nothing. An error is a text for users.
    pub fn keep(
        &mut self,
        (drafts, setup): (&Drafts, &Setup),
        name: &str,
        text: Option<&str>,
        over: &str,
    ) -> Result<(), String> {
        let Some(store) = &mut self.store else { return Ok(()) };
        let file = edit::path_of(drafts, setup, name)?;
        let kept = store.keep(&file, over, text);
        let has_failed = std::mem::replace(&mut self.has_failed, kept.is_err());
        if has_failed { Ok(()) } else { kept }
    }

    /// Forgets a text that was offered.
    pub fn discard(&mut self, id: &str) {
        if let Some(store) = &mut self.store {
            store.discard(id);
        }
    }
}
