//! Which program emulates robots.

use std::env;
use std::path::{Path, PathBuf};

/// Plays every robot on an STM32.
pub const STM32: &str = "bbz-emulate-stm32";

/// Where the program is: beside this one, or wherever PATH finds it, unless it is named by a path. Without a name it is the
/// `usual` one.
pub fn program(named: Option<&Path>, usual: &str) -> PathBuf {
    let usual = || PathBuf::from(format!("{usual}{}", env::consts::EXE_SUFFIX));
    let name = named.map_or_else(usual, Path::to_owned);
    let beside = match name.components().count() {
        1 => env::current_exe().ok().map(|this| this.with_file_name(&name)),
        _ => None,
    };
    beside.filter(|path| path.is_file()).unwrap_or(name)
}
