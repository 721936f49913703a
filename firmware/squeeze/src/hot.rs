//! Functions of the virtual machine in which a script spends its time. They keep their entry, their exit and their sequences.

/// Their names.
const HOT: [&str; 29] = [
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

/// Handlers of interrupts, while which others wait: their symbols begin so.
const INTERRUPT: &str = "__vector_";

/// Whether that is the symbol of one of them: a mangled name holds each part behind its length.
pub fn is_hot(symbol: &str) -> bool {
    symbol.starts_with(INTERRUPT)
        || HOT.iter().any(|name| symbol.contains(&format!("{}{name}", name.len())))
}
