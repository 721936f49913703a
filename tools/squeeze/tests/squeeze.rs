//! Tests the changes to assembly, and the code that must stay unchanged.

use bittybuzz_squeeze::squeeze as with_contracts;

/// Returns only the squeezed text.
fn squeeze(assembly: &str, is_hot: impl Fn(&str) -> bool) -> String {
    with_contracts(assembly, is_hot).text
}

/// A function as LLVM writes it.
fn function(symbol: &str, body: &str) -> String {
    format!(
        "\t.section\t.text.{symbol},\"ax\",@progbits\n{symbol}:\n.Lfunc_begin0:\n{body}.Lfunc_end0:\n"
    )
}

/// Returns the instructions and labels of a function after squeezing, without those that only the
/// debugger needs.
fn squeezed(assembly: &str) -> Vec<String> {
    squeeze(assembly, |symbol| symbol == "hot")
        .lines()
        .map(|line| line.trim().replace('\t', " "))
        .filter(|line| {
            !line.is_empty() && !line.starts_with(".section") && !line.starts_with(".Lfunc")
        })
        .collect()
}

fn body(lines: &[&str]) -> String {
    lines
        .iter()
        .map(|line| {
            if line.ends_with(':') {
                format!("{line}\n")
            } else {
                format!("\t{}\n", line.replacen(' ', "\t", 1))
            }
        })
        .collect()
}

#[test]
fn a_branch_goes_straight_to_its_target() {
    let code = ["cpi r24, 3", "brne .L1", "rjmp .L2", ".L1:", "inc r24", ".L2:", "ret"];
    assert_eq!(
        squeezed(&function("f", &body(&code))),
        ["f:", "cpi r24, 3", "breq .L2", "inc r24", ".L2:", "ret"]
    );
}

#[test]
fn a_branch_reaches_126_bytes_and_no_further() {
    // 63 words forward, counted from the instruction after the branch (instruction set manual,
    // BREQ).
    for (between, is_straight) in [(63, true), (64, false)] {
        let mut code = vec!["cpi r24, 3", "brne .L1", "rjmp .L2", ".L1:"];
        // Each instruction has another register, so that there is no sequence to share.
        let fill: Vec<String> =
            (0..between).map(|n| format!("out {}, r{}", n % 32, n / 32)).collect();
        code.extend(fill.iter().map(String::as_str));
        code.extend([".L2:", "ret"]);
        let result = squeezed(&function("f", &body(&code)));
        assert_eq!(result.contains(&"breq .L2".to_owned()), is_straight, "{between}");
        assert_eq!(result.contains(&"rjmp .L2".to_owned()), !is_straight, "{between}");
    }
}

#[test]
fn a_branch_that_may_be_skipped_stays() {
    let code = ["sbrs r24, 1", "brne .L1", "rjmp .L2", ".L1:", "inc r24", ".L2:", "ret"];
    let result = squeezed(&function("f", &body(&code)));
    assert_eq!(result[1..4], ["sbrs r24, 1", "brne .L1", "rjmp .L2"]);
}

#[test]
fn what_is_jumped_to_moves_behind_the_jump() {
    let code = [
        "cpi r24, 1",
        "breq .L1",
        "ldi r24, 7",
        "rjmp .L3",
        ".L1:",
        "ldi r24, 8",
        "ret",
        ".L3:",
        "inc r24",
        "ret",
    ];
    assert_eq!(
        squeezed(&function("f", &body(&code))),
        [
            "f:",
            "cpi r24, 1",
            "breq .L1",
            "ldi r24, 7",
            "inc r24",
            "ret",
            ".L1:",
            "ldi r24, 8",
            "ret"
        ]
    );
}

#[test]
fn a_function_that_is_fallen_into_stays_where_it_is() {
    let code =
        ["cpi r24, 1", "breq .L1", "rjmp .L2", ".L1:", "inc r24", ".L2:", "dec r24", "rjmp .L1"];
    let result = squeezed(&function("f", &body(&code)));
    assert_eq!(
        result,
        ["f:", "cpi r24, 1", "brne .L2", ".L1:", "inc r24", ".L2:", "dec r24", "rjmp .L1"]
    );
}

#[test]
fn comparisons_of_which_the_result_is_known_go() {
    let code = [
        "andi r24, 4",
        "cpi r24, 0",
        "brne .L1",
        "cpi r20, 5",
        "brlt .L1",
        "cpi r20, 5",
        "breq .L1",
        "inc r22",
        ".L1:",
        "ret",
    ];
    assert_eq!(
        squeezed(&function("f", &body(&code))),
        [
            "f:",
            "andi r24, 4",
            "brne .L1",
            "cpi r20, 5",
            "brlt .L1",
            "breq .L1",
            "inc r22",
            ".L1:",
            "ret"
        ]
    );
}

#[test]
fn comparisons_that_count_stay() {
    for code in [
        // Another register.
        ["andi r24, 4", "cpi r25, 0", "breq .L1", ".L1:", "ret"],
        // The carry of `add` is not that of a comparison with 0.
        ["add r24, r22", "cpi r24, 0", "brcs .L1", ".L1:", "ret"],
        // `mov` sets no flags.
        ["mov r24, r22", "cpi r24, 0", "breq .L1", ".L1:", "ret"],
        // Other code branches to this place, too.
        ["andi r24, 4", ".L1:", "cpi r24, 0", "brne .L1", "ret"],
    ] {
        let result = squeezed(&function("f", &body(&code)));
        assert!(result.iter().any(|line| line.starts_with("cpi")), "{result:?}");
    }
}

/// Saves r12 to r17 and Y, and makes room for 5 bytes.
const ENTRY: [&str; 16] = [
    "push r12",
    "push r13",
    "push r14",
    "push r15",
    "push r16",
    "push r17",
    "push r28",
    "push r29",
    "in r28, 61",
    "in r29, 62",
    "sbiw r28, 5",
    "in r0, 63",
    "cli",
    "out 62, r29",
    "out 63, r0",
    "out 61, r28",
];
const EXIT: [&str; 15] = [
    "adiw r28, 5",
    "in r0, 63",
    "cli",
    "out 62, r29",
    "out 63, r0",
    "out 61, r28",
    "pop r29",
    "pop r28",
    "pop r17",
    "pop r16",
    "pop r15",
    "pop r14",
    "pop r13",
    "pop r12",
    "ret",
];

#[test]
fn entry_and_exit_are_shared() {
    let code = [&ENTRY[..], &["out 5, r24"], &EXIT].concat();
    let result = squeezed(&function("f", &body(&code)));
    assert_eq!(
        result[..6],
        [
            "f:",
            "ldi r26, 5",
            "call __save_12_room",
            "out 5, r24",
            "ldi r26, 5",
            "jmp __restore_12_room"
        ]
    );
    // The routines replace the removed code: registers in the same order, the same room.
    let at = |label: &str| result.iter().position(|line| line == label).expect("it is there");
    let saves = &result[at(".Lpush_12_room:")..at("__restore_12_room:")];
    let saved: Vec<&str> = saves.iter().filter_map(|line| line.strip_prefix("push ")).collect();
    assert_eq!(saved, ["r12", "r13", "r14", "r15", "r16", "r17", "r28", "r29"]);
    assert_eq!(saves.last().map(String::as_str), Some("ijmp"));
    let restored: Vec<&str> = result[at("__restore_12_room:")..]
        .iter()
        .filter_map(|line| line.strip_prefix("pop "))
        .collect();
    assert_eq!(restored, ["r29", "r28", "r17", "r16", "r15", "r14", "r13", "r12"]);
}

#[test]
fn an_entry_whose_exit_is_another_stays() {
    let mut other = EXIT;
    other[13] = "pop r11";
    for exit in [&other[..], &EXIT[1..], &[&EXIT[..8], &[".L9:"], &EXIT[8..]].concat()] {
        let code = [&ENTRY[..], &["out 5, r24", "rjmp .L9"], exit].concat();
        let result = squeezed(&function("f", &body(&code)));
        assert!(!result.iter().any(|line| line.contains("__save")), "{result:?}");
        assert_eq!(result.iter().filter(|line| line.starts_with("push")).count(), 8);
    }
}

#[test]
fn hot_functions_keep_their_code() {
    let code = [&ENTRY[..], &["out 5, r24"], &EXIT].concat();
    let result = squeezed(&function("hot", &body(&code)));
    assert_eq!(result.len(), 1 + ENTRY.len() + 1 + EXIT.len());
}

#[test]
fn sequences_that_come_again_are_shared() {
    let sequence = ["lds r24, 300", "lds r25, 301", "adiw r24, 1", "sts 300, r24"];
    let code = [&sequence[..], &["inc r20"], &sequence, &["inc r21"], &sequence, &["ret"]].concat();
    let result = squeezed(&function("f", &body(&code)));
    let call = "call __sequence_0";
    assert_eq!(result[..7], ["f:", call, "inc r20", call, "inc r21", call, "ret"]);
    assert_eq!(result[7..], [&["__sequence_0:"], &sequence[..], &["ret"]].concat());
}

#[test]
fn what_needs_the_stack_where_it_is_stays() {
    let sequence =
        ["lds r24, 300", "in r28, 61", "sts 300, r24", "push r24", "lds r25, 301", "cli"];
    let code = [&sequence[..], &["inc r20"], &sequence, &["inc r21"], &sequence, &["ret"]].concat();
    let result = squeezed(&function("f", &body(&code)));
    assert_eq!(result.len(), 1 + code.len());
}

#[test]
fn names_of_sources_come_first_and_are_one_name() {
    let code = function("f", "\t.file\t1 \"/folder\" \"a.rs\"\n\t.loc\t1 2 3\n\tret\n");
    let result = squeeze(&code, |_| false);
    assert_eq!(result.lines().next(), Some("\t.file\t1 \"/folder/a.rs\""));
}

#[test]
fn who_calls_comes_near_to_who_is_called() {
    // There are 5,000 bytes between them: more than a short call reaches.
    let filler: String = (0..2500).map(|n| format!("\tout\t{}, r{}\n", n % 47, n % 29)).collect();
    let code = [
        function("a", "\tcall\tb\n\tret\n"),
        function("hot", &format!("{filler}\tret\n")),
        function("b", "\tinc\tr24\n\tret\n"),
    ]
    .concat();
    let result = squeezed(&code);
    let at = |label: &str| result.iter().position(|line| line == label).expect("it is there");
    assert!(at("a:").abs_diff(at("b:")) < 10);
    assert_eq!(result.len(), 3 + 2 + 2501 + 2, "everything is there once");
    // The code there belongs to the same function as before.
    assert_eq!(result[at("b:") + 1..=at("b:") + 2], ["inc r24", "ret"]);
}

#[test]
fn what_is_cut_off_or_odd_stays() {
    let whole = function("f", &body(&[&ENTRY[..], &["out 5, r24"], &EXIT].concat()));
    // The text is cut off, as by a full disk: without the end of a function, the function is left
    // unchanged.
    for length in 0..whole.len() - ".Lfunc_end0:\n".len() {
        let text = &whole[..length];
        let result = squeeze(text, |_| false);
        assert!(result.split_whitespace().eq(text.split_whitespace()), "{length}: {result}");
    }
    for text in
        ["", "\n", "f:\n", "\tbreq\n", "\trjmp\t.L1\n", ".Lfunc_end0:\n", "\t.section\t.text.f\n"]
    {
        assert_eq!(squeeze(text, |_| false).trim(), text.trim(), "{text:?}");
    }
}

/// Both functions, and one that calls them from outside.
fn pair(one: &[&str], other: &[&str]) -> String {
    [function("f", &body(one)), function("g", &body(other))].concat()
}

#[test]
fn copies_that_nobody_reads_go() {
    // r22 is another name for what is in r24, and r18 is no result.
    let code = ["mov r22, r24", "mov r23, r22", "movw r18, r22", "sts 300, r23", "ret"];
    let result = squeezed(&pair(&["call g", "sts 301, r24", ".L0:", "rjmp .L0"], &code));
    assert_eq!(result[..5], ["f:", "call g", "sts 301, r24", ".L0:", "rjmp .L0"]);
    assert_eq!(result[5..], ["g:", "sts 300, r24", "ret"]);
}

#[test]
fn results_that_a_caller_reads_stay() {
    for (reads, count) in [("sts 301, r22", 1), ("sts 301, r20", 0), ("push r22", 1)] {
        let caller = ["call g", reads, ".L0:", "rjmp .L0"];
        let result = squeezed(&pair(&caller, &["mov r22, r24", "sts 300, r24", "ret"]));
        let copies = result.iter().filter(|line| *line == "mov r22, r24").count();
        assert_eq!(copies, count, "{reads}");
    }
    // Unknown callers may read any result: callers by address, and those in other files.
    for directive in ["\t.short\tpm(g)\n", "\t.globl\tg\n", ""] {
        let caller = if directive.is_empty() { "call\th" } else { "call\tg" };
        let code = [
            directive,
            &function("f", &format!("\t{caller}\n\tret\n")),
            &function("g", "\tmov\tr22, r24\n\tret\n"),
        ]
        .concat();
        assert!(squeezed(&code).contains(&"mov r22, r24".to_owned()), "{directive}");
    }
}

#[test]
fn arguments_that_a_function_reads_stay() {
    // g reads r22 only after its branch; an unknown function may read anything, h nothing.
    let g = function("g", &body(&["cpi r24, 1", "breq .L1", "sts 300, r22", ".L1:", "ret"]));
    let h = function("h", &body(&["sts 302, r1", "ret"]));
    for (callee, count) in [("g", 1), ("memset", 1), ("h", 0)] {
        let call = format!("call {callee}");
        let f = function("f", &body(&["ldi r22, 7", &call, ".L0:", "rjmp .L0"]));
        let result = squeezed(&[f, g.clone(), h.clone()].concat());
        assert_eq!(result.iter().filter(|line| *line == "ldi r22, 7").count(), count, "{callee}");
    }
}

#[test]
fn zero_is_zero_again_behind_a_multiplication() {
    let code = ["mul r24, r22", "movw r24, r0", "clr r1", "cpc r25, r1", "brlo .L1", ".L1:", "ret"];
    let result = squeezed(&function("f", &body(&code)));
    assert!(result.contains(&"clr r1".to_owned()), "{result:?}");
}

#[test]
fn the_high_byte_of_a_small_number_is_not_compared() {
    let compare = ["movw r20, r24", "andi r21, 0", "cpi r20, 6", "cpc r21, r1"];
    let code = |branch: &'static str| {
        let rest = [branch, "sts 300, r1", ".L1:", "ret"];
        let caller = ["call g", ".L0:", "rjmp .L0"];
        squeezed(&pair(&caller, &[&compare[..], &rest].concat())).split_off(caller.len() + 1)
    };
    for branch in ["breq .L1", "brne .L1", "brlo .L1"] {
        assert_eq!(code(branch)[..3], ["g:", "cpi r24, 6", branch], "{branch}");
    }
    // As signed numbers, 200 and 6 compare otherwise in one byte.
    assert!(code("brlt .L1").iter().any(|line| line.starts_with("cpc")));
}

#[test]
fn flags_that_are_read_stay() {
    for (makes, reads) in
        [("andi r24, 0", "breq .L1"), ("clr r24", "brmi .L1"), ("subi r24, 1", "brcs .L1")]
    {
        let code = [makes, reads, "sts 300, r1", ".L1:", "ret"];
        let result = squeezed(&pair(&["call g", "ret"], &code));
        assert!(result.contains(&makes.to_owned()), "{result:?}");
    }
    // SREG is read as a whole.
    let code = ["cpi r24, 3", "in r0, 63", "sts 300, r0", "ret"];
    assert_eq!(squeezed(&function("f", &body(&code))).len(), 5);
}

#[test]
fn what_may_be_skipped_tells_nothing() {
    let code = ["ldi r25, 1", "sbrc r24, 0", "ldi r25, 2", "ldi r25, 2", "sts 300, r25", "ret"];
    let result = squeezed(&function("f", &body(&code)));
    assert_eq!(result.iter().filter(|line| *line == "ldi r25, 2").count(), 2, "{result:?}");
}

#[test]
fn ends_are_shared() {
    // Within a function even a single instruction is shared, also with an end that falls through.
    let code = [
        "cpi r24, 1",
        "breq .L1",
        "sts 300, r22",
        "sts 301, r24",
        "rjmp .L2",
        ".L1:",
        "sts 302, r22",
        "sts 301, r24",
        ".L2:",
        "sts 303, r20",
        "ret",
    ];
    let result = squeezed(&function("f", &body(&code)));
    assert_eq!(result.iter().filter(|line| *line == "sts 301, r24").count(), 1, "{result:?}");
    // Ends are also shared between functions, hot or not.
    let end = ["sts 300, r22", "sts 301, r24", "ret"];
    let code = [
        function("f", &body(&[&["sts 302, r22"], &end[..]].concat())),
        function("hot", &body(&[&["sts 303, r22"], &end[..]].concat())),
    ];
    let result = squeezed(&code.concat());
    assert_eq!(result.iter().filter(|line| *line == "ret").count(), 1, "{result:?}");
    assert_eq!(result.iter().filter(|line| line.starts_with("jmp __tail")).count(), 1);
}

#[test]
fn ends_that_are_not_the_same_stay() {
    // A branch to a place of its own function, and an instruction that may be skipped.
    let f = ["sts 302, r22", "breq .L1", "sts 301, r24", "ret", ".L1:", "ret"];
    let g = ["sts 303, r22", "breq .L3", "sts 301, r24", "ret", ".L3:", "ret"];
    let result = squeezed(&pair(&f, &g));
    assert_eq!(result.iter().filter(|line| line.starts_with("breq")).count(), 2, "{result:?}");
    let f = ["sts 302, r22", "sbrc r24, 0", "sts 301, r24", "ret"];
    let g = ["sts 303, r22", "sbrc r24, 1", "sts 301, r24", "ret"];
    let result = squeezed(&pair(&f, &g));
    let at = result.iter().position(|line| line == "sbrc r24, 1").expect("it is there");
    assert_eq!(result[at + 1], "sts 301, r24", "{result:?}");
}

#[test]
fn a_branch_may_lead_to_another_jump() {
    // .L9 is out of reach of the first branch, but the other jump to it is not.
    let fill: Vec<String> = (0..80).map(|n| format!("out {}, r{}", n % 32, n / 32)).collect();
    let mut code = vec!["cpi r24, 1", "brne .L1", "rjmp .L9", ".L1:", "sts 300, r22", "rjmp .L9"];
    code.extend([".L2:"]);
    code.extend(fill.iter().map(String::as_str));
    code.extend([".L9:", "cpi r20, 1", "breq .L2", "ret"]);
    let result = squeezed(&function("f", &body(&code)));
    assert_eq!(result[1..3], ["cpi r24, 1", "breq .Lchain_0"], "{result:?}");
    assert_eq!(result.iter().filter(|line| *line == "rjmp .L9").count(), 1);
    let at = result.iter().position(|line| line == ".Lchain_0:").expect("it is there");
    assert_eq!(result[at + 1], "rjmp .L9");
}

#[test]
fn calls_are_moved_with_what_stands_before() {
    let sequence = ["ldi r22, 7", "ldi r20, 9", "call h"];
    let code =
        [&sequence[..], &["sts 300, r24"], &sequence, &["sts 301, r24"], &sequence, &["ret"]];
    let result = squeezed(&function("f", &body(&code.concat())));
    assert_eq!(result[..3], ["f:", "call __sequence_0", "sts 300, r24"], "{result:?}");
    // Routines that save registers leave them on the stack.
    let saves = ["ldi r22, 7", "ldi r26, 9", "call __save_12_room"];
    let code = [&saves[..], &["sts 300, r24"], &saves, &["sts 301, r24"], &saves, &["ret"]];
    let result = squeezed(&function("f", &body(&code.concat())));
    assert_eq!(result.iter().filter(|line| *line == "call __save_12_room").count(), 3);
}

#[test]
fn what_a_call_finds_on_the_stack_stays_there() {
    let sequence = ["ldi r22, 7", "ldi r20, 9", "call g"];
    let code =
        [&sequence[..], &["sts 300, r24"], &sequence, &["sts 301, r24"], &sequence, &["ret"]];
    for (at, calls) in [(5, 1), (16, 3)] {
        // The function's variables take five bytes; eight saved registers and the return address
        // lie between them and the arguments.
        let reads = format!("ldd r24, Y+{at}");
        let g = [&ENTRY[..], &[&reads, "add r24, r22", "add r24, r20"], &EXIT].concat();
        let result = squeezed(&pair(&code.concat(), &g));
        assert_eq!(result.iter().filter(|line| *line == "call g").count(), calls, "{result:?}");
    }
}

#[test]
fn what_the_programmer_wrote_stays() {
    let by_hand = ["mov r24, r22", "mov r24, r22", "andi r21, 0", "sts 300, r24"];
    let text = |name: &str| function(name, &format!(";APP\n{};NO_APP\n\tret\n", body(&by_hand)));
    let result = squeezed(&text("f"));
    for line in by_hand {
        let count = by_hand.iter().filter(|other| **other == line).count();
        assert_eq!(result.iter().filter(|other| *other == line).count(), count, "{result:?}");
    }
}
