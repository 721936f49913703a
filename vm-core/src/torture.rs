//! Makes memory scarce on request, for tests: see feature `torture`.

/// What to do to allocations.
#[derive(Debug, Clone, Copy, Default)]
pub struct Torture {
    /// Every allocation collects first.
    pub collect_always: bool,
    /// The allocation of that number, counted from 0, fails.
    pub fail_at: Option<u32>,
    /// Allocations so far.
    pub allocations: u32,
}

impl Torture {
    /// Nothing, as by default.
    pub(crate) const NONE: Torture =
        Torture { collect_always: false, fail_at: None, allocations: 0 };

    /// Counts an allocation and tells whether it must fail.
    pub(crate) fn refuses(&mut self) -> bool {
        self.allocations += 1;
        self.fail_at == Some(self.allocations - 1)
    }
}
