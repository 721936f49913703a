//! Telling a debug probe, if the feature `defmt` is on; else the macros do nothing, not even compute their arguments.

/// What people may want to know.
macro_rules! info {
    ($($argument:tt)*) => {{
        #[cfg(feature = "defmt")]
        defmt::info!($($argument)*);
    }};
}

/// What people should know.
macro_rules! warning {
    ($($argument:tt)*) => {{
        #[cfg(feature = "defmt")]
        defmt::warn!($($argument)*);
    }};
}

/// What has failed.
macro_rules! error {
    ($($argument:tt)*) => {{
        #[cfg(feature = "defmt")]
        defmt::error!($($argument)*);
    }};
}

pub(crate) use {error, info, warning};
