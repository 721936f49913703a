//! What becomes of assembly, and what is left alone.

use bittybuzz_squeeze::squeeze;

/// A function as LLVM writes it.
fn function(symbol: &str, body: &str) -> String {
    format!(
        "\t.section\t.text.{symbol},\"ax\",@progbits\n{symbol}:\n.Lfunc_begin0:\n{body}.Lfunc_end0:\n"
    )
}

/// The instructions and labels of a function after squeezing, without those that only the debugger needs.
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
    // 63 words forward, counted from behind the branch (instruction set manual, BREQ).
    for (between, is_straight) in [(63, true), (64, false)] {
        let mut code = vec!["cpi r24, 3", "brne .L1", "rjmp .L2", ".L1:"];
        // Each another register, so that there is no sequence to be shared.
        let fill: Vec<String> = (0..between).map(|n| format!("ldi r24, {n}")).collect();
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
        // Somebody else comes here, too.
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
    let code = [&ENTRY[..], &["mov r12, r24"], &EXIT].concat();
    let result = squeezed(&function("f", &body(&code)));
    assert_eq!(
        result[..6],
        [
            "f:",
            "ldi r26, 5",
            "call __save_12_room",
            "mov r12, r24",
            "ldi r26, 5",
            "jmp __restore_12_room"
        ]
    );
    // The routines do what stood there: registers in the same order, the same room.
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
        let code = [&ENTRY[..], &["mov r12, r24", "rjmp .L9"], exit].concat();
        let result = squeezed(&function("f", &body(&code)));
        assert!(!result.iter().any(|line| line.contains("__save")), "{result:?}");
        assert_eq!(result.iter().filter(|line| line.starts_with("push")).count(), 8);
    }
}

#[test]
fn hot_functions_keep_their_code() {
    let code = [&ENTRY[..], &["mov r12, r24"], &EXIT].concat();
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
    // 5,000 bytes between them: further than a short call reaches.
    let filler: String =
        (0..2500).map(|n| format!("\tldi\tr{}, {}\n", 16 + n % 16, n % 251)).collect();
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
    // What stands there belongs to the same function as before.
    assert_eq!(result[at("b:") + 1..=at("b:") + 2], ["inc r24", "ret"]);
}

#[test]
fn what_is_cut_off_or_odd_stays() {
    let whole = function("f", &body(&[&ENTRY[..], &["mov r12, r24"], &EXIT].concat()));
    // As if the disk had been full: no end of the function, so nothing is known of it.
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
