//! Hot functions, which keep their entry, exit and sequences: the functions of the virtual machine
//! in which a script spends most of its time.

/// Only the interpreter's loop, for chips with little flash.
pub const LOOP: &[&str] = &["interpret"];

/// All hot functions: eight messages take a seventh less time, and the machine takes 1.8 kB more.
pub const PATHS: &[&str] = &[
    "interpret",
    "call_back",
    "call",
    "next_message",
    "hear",
    "find_neighbor",
    "translate_string",
    "translate",
    "find_pair",
    "array_slot",
    "resume",
    "table_next",
    "table_set",
    "table_get",
    "mark",
    "sweep",
    "divide_quickly",
    "take_cell",
    "enter_function",
    "begin_messages",
    "keep_in_touch",
    "get_quickly",
    "set_quickly",
    "slow",
    "make_closure",
    "begin",
    "run",
    "index_get",
    "begin_native",
    "allocate",
];

/// The prefix of symbols of interrupt handlers, which delay other interrupts.
const INTERRUPT: &str = "__vector_";

/// Returns true for an interrupt handler or a function with one of those names. In a mangled symbol
/// each part follows its length; the name of a method follows the `E` that ends its type, that of
/// another function is at the end.
pub fn is_hot(symbol: &str, names: &[&str]) -> bool {
    let is_named = |name: &&str| {
        let part = format!("{}{name}", name.len());
        symbol.ends_with(&part) || symbol.contains(&format!("E{part}"))
    };
    symbol.starts_with(INTERRUPT) || names.iter().any(is_named)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_are_found_and_modules_of_that_name_are_not() {
        assert!(is_hot(
            "_RNvMNtNtCs9_17bittybuzz_vm_core7machine4callINtB4_2VmE4pushE4callB1w_",
            PATHS
        ));
        assert!(!is_hot("_RNvMNtNtCs9_17bittybuzz_vm_core7machine4callINtB4_2VmE4pushB1w_", PATHS));
        assert!(is_hot("_RNvNtNtCs9_17bittybuzz_vm_core7message5frame16translate_string", PATHS));
        assert!(!is_hot("_RNvMs_NtNtCs9_17bittybuzz_vm_core7machine9interpretE3useB1w_", PATHS));
        assert!(is_hot("__vector_11", PATHS));
    }
}
