//! Proofs and refusals of squeezed assembly.

use bittybuzz_squeeze::proof::{DifferenceKind, SqueezeRefusal, prove};
use bittybuzz_squeeze::squeeze;

/// A function as LLVM writes it.
fn function(symbol: &str, lines: &[&str]) -> String {
    let body: String = lines
        .iter()
        .map(|line| match line {
            label if label.ends_with(':') => format!("{label}\n"),
            line => format!("\t{}\n", line.replacen(' ', "\t", 1)),
        })
        .collect();
    format!(
        "\t.section\t.text.{symbol},\"ax\",@progbits\n{symbol}:\n.Lfunc_begin_{symbol}:\n{body}.Lfunc_end_{symbol}:\n"
    )
}

/// Returns the squeezed text after its proof.
fn proved(text: &str) -> Vec<String> {
    let squeezed = squeeze(text, |symbol| symbol == "hot");
    if let Err(refusal) = prove(text, &squeezed.text, &squeezed.contracts) {
        panic!("{refusal}");
    }
    squeezed.text.lines().map(|line| line.trim().replace('\t', " ")).collect()
}

/// Returns the reason why a text is not a valid squeezed form of another.
fn refused(original: &str, wrong: &str) -> SqueezeRefusal {
    match prove(original, wrong, &squeeze(original, |_| true).contracts) {
        Err(refusal) => refusal,
        Ok(report) => panic!("it was not refused: {report}"),
    }
}

fn cause(original: &[&str], wrong: &[&str]) -> DifferenceKind {
    match refused(&function("f", original), &function("f", wrong)) {
        SqueezeRefusal::Difference(difference) => difference.cause,
        other => panic!("{other}"),
    }
}

fn count(lines: &[String], wanted: &str) -> usize {
    lines.iter().filter(|line| *line == wanted).count()
}

/// Returns the lines four times, with others between them.
fn four_times(lines: &[&'static str]) -> Vec<&'static str> {
    let mut all = Vec::new();
    for between in ["inc r20", "inc r21", "inc r22", "inc r23"] {
        all.extend(lines);
        all.push(between);
    }
    all.push("ret");
    all
}

#[test]
fn functions_that_no_image_has_are_proved() {
    proved(include_str!("functions.s"));
}

#[test]
fn assembly_that_only_reads_flash_is_shared() {
    // The timing of this block has no effect.
    let word = [";APP", "lpm r0, Z+", "lpm r31, Z", "mov r30, r0", ";NO_APP", "sts 300, r31"];
    let result = proved(&function("f", &four_times(&[&["movw r30, r24"], &word[..]].concat())));
    assert_eq!(count(&result, "lpm r31, Z"), 1, "{result:?}");
    let pulse = [";APP", "lpm r0, Z+", "cbi 5, 1", ";NO_APP", "sts 300, r0"];
    let result = proved(&function("f", &four_times(&[&["movw r30, r24"], &pulse[..]].concat())));
    assert_eq!(count(&result, "lpm r0, Z+"), 4, "{result:?}");
}

#[test]
fn assembly_by_hand_stays_where_it_is() {
    // A pulse whose cycles are counted, in the form of an inlined function.
    let pulse = ["; APP", "sbi 5, 1", "nop", "nop", "cbi 5, 1", "; NO_APP"];
    let result = proved(&function("f", &four_times(&pulse)));
    assert_eq!(result.windows(6).filter(|window| *window == pulse).count(), 4, "{result:?}");
}

#[test]
fn flags_that_may_have_been_skipped_count_as_unknown() {
    let end = ["breq .L1", "inc r22", ".L1:", "ret"];
    let code = [&["sbrc r20, 0", "inc r24", "cpi r24, 0"], &end[..]].concat();
    assert_eq!(count(&proved(&function("f", &code)), "cpi r24, 0"), 1);
    let code = [&["sbrc r20, 0", "cpi r24, 5", "breq .L1", "cpi r24, 5"], &end[..]].concat();
    assert_eq!(count(&proved(&function("f", &code)), "cpi r24, 5"), 2);
}

#[test]
fn timed_writes_stay_together() {
    // The second write to WDTCSR has to come within four cycles.
    let mut code = Vec::new();
    for second in ["sts 96, r25", "sts 96, r20", "sts 96, r22"] {
        code.extend(["lds r18, 300", "lds r19, 301", "ldi r24, 24", "sts 96, r24", second]);
        code.push("inc r21");
    }
    code.push("ret");
    let result = proved(&function("f", &code));
    let pairs = result.windows(2).filter(|pair| pair[0] == "sts 96, r24");
    assert_eq!(pairs.filter(|pair| pair[1].starts_with("sts 96")).count(), 3, "{result:?}");
}

#[test]
fn code_with_interrupts_off_is_not_shared() {
    let section = ["cli", "lds r24, 300", "adiw r24, 1", "sts 300, r24", "sts 301, r25", "sei"];
    let result = proved(&function("f", &four_times(&section)));
    assert_eq!(result.windows(6).filter(|window| *window == section).count(), 4, "{result:?}");
}

#[test]
fn a_handler_does_not_find_zero_in_r1() {
    let code = ["push r1", "push r24", "ldi r24, 0", "sts 301, r24", "pop r24", "pop r1", "reti"];
    let result = proved(&function("__vector_3", &code));
    assert_eq!(count(&result, "sts 301, r24"), 1, "{result:?}");
}

#[test]
fn jump_tables_are_refused() {
    let code = [
        "mov r30, r24",
        "ldi r31, 0",
        "subi r30, lo8(-(gs(.L0)))",
        "sbci r31, hi8(-(gs(.L0)))",
        "ijmp",
        ".L0:",
        "rjmp .L1",
        "rjmp .L2",
        ".L1:",
        "ldi r24, 1",
        "ret",
        ".L2:",
        "ldi r24, 2",
        "ret",
    ];
    let text = function("f", &code);
    let refusal = prove(&text, &text, &squeeze(&text, |_| false).contracts).unwrap_err();
    let message = refusal.to_string();
    assert!(message.contains("function `f`, line 8"), "{message}");
    assert!(message.contains("-C jump-tables=no"), "{message}");
}

#[test]
fn an_argument_that_is_pushed_first_is_read() {
    let callee = function("g", &["push r24", "call use", "pop r0", "ret"]);
    let caller = function("f", &["ldi r24, 5", "call g", "ret"]);
    let squeezed = squeeze(&[caller, callee].concat(), |_| false).text;
    assert!(squeezed.contains("ldi\tr24, 5"), "{squeezed}");
}

#[test]
fn status_in_hexadecimal_is_read_as_well() {
    let code = ["cp r24, r22", "in r0, 0x3f", "sts 300, r0", "ret"];
    assert_eq!(count(&proved(&function("f", &code)), "cp r24, r22"), 1);
}

#[test]
fn what_is_not_known_is_refused() {
    for (lines, reason) in [
        (&["fmul r16, r17", "ret"][..], "the instruction `fmul` is not known"),
        (&["ldi r30, lo8(.+6)", "ret"], "the operand `r30, lo8(.+6)` is not known"),
        (&[".byte 1", "ret"], "the directive `.byte"),
        (&["rjmp .L7"], "there is no label `.L7`"),
        (&["lds r24, 95", "ret"], "use `in` and `out`"),
        (&[".L1:", ".L1:", "ret"], "the label `.L1` stands twice"),
    ] {
        let text = function("f", lines);
        let message = prove(&text, &text, &squeeze("", |_| false).contracts).unwrap_err();
        assert!(message.to_string().contains(reason), "{message}");
        assert!(message.to_string().contains("function `f`, line "), "{message}");
    }
    let cut = function("f", &["ret"]).replace(".Lfunc_end_f:\n", "");
    assert!(matches!(refused(&cut, &cut), SqueezeRefusal::Original(_)));
}

#[test]
fn other_values_are_refused() {
    let store = |original: &[&'static str], wrong: &[&'static str]| {
        let end = ["sts 300, r24", "ret"];
        let cause = cause(&[original, &end].concat(), &[wrong, &end].concat());
        assert!(matches!(cause, DifferenceKind::Event { .. }), "{original:?} {wrong:?}: {cause}");
    };
    store(&["mov r24, r22"], &["mov r24, r23"]);
    store(&["movw r24, r22"], &["movw r24, r20"]);
    store(&["subi r24, 1"], &["subi r24, 2"]);
    store(&["add r24, r22"], &["adc r24, r22"]);
    store(&["ldi r24, lo8(a+1)"], &["ldi r24, lo8(a+2)"]);
    store(&["lds r24, 301"], &["lds r24, 302"]);
    store(&["lds r24, 301"], &["clr r24"]);
    store(&["ldd r24, Z+3"], &["ldd r24, Z+4"]);
    store(&["sts 299, r22"], &[]);
    store(&["sbrc r24, 0", "inc r24"], &["inc r24"]);
    store(&["cpi r22, 3", "breq .L1", "inc r24", ".L1:"], &["cpi r22, 3", "inc r24"]);
    store(
        &["cpi r22, 3", "breq .L1", "inc r24", ".L1:"],
        &["cpi r22, 3", "brne .L1", "inc r24", ".L1:"],
    );
    store(
        &["cpi r22, 3", "brlt .L1", "inc r24", ".L1:"],
        &["cpi r22, 3", "brlo .L1", "inc r24", ".L1:"],
    );
}

#[test]
fn other_registers_at_the_end_are_refused() {
    let end = |original: &[&'static str], wrong: &[&'static str]| {
        let end = ["ret"];
        cause(&[original, &end].concat(), &[wrong, &end].concat())
    };
    let is_register = |cause: DifferenceKind, wanted| {
        assert!(
            matches!(cause, DifferenceKind::Register { number, .. } if number == wanted),
            "{cause}"
        );
    };
    is_register(end(&["ldi r24, 1"], &["ldi r24, 2"]), 24);
    is_register(end(&["push r16", "ldi r16, 1", "pop r16"], &["ldi r16, 1"]), 16);
    is_register(
        end(
            &["push r16", "push r17", "clr r16", "clr r17", "pop r17", "pop r16"],
            &["push r16", "push r17", "clr r16", "clr r17", "pop r16", "pop r17"],
        ),
        16,
    );
    is_register(end(&["mul r24, r22", "clr r1"], &["mul r24, r22"]), 1);
    assert_eq!(
        end(&["push r24", "pop r24"], &["push r24"]),
        DifferenceKind::Event {
            original: "a return".to_owned(),
            squeezed: "a return to nowhere".to_owned(),
        }
    );
}

#[test]
fn other_calls_are_refused() {
    let callee = function("g", &["sts 300, r24", "sts 301, r22", "ret"]);
    let text = |body: &[&str]| [function("f", body), callee.clone()].concat();
    let original = text(&["ldi r24, 1", "ldi r22, 2", "call g", "sts 302, r28", "ret"]);
    for wrong in [
        &["ldi r24, 1", "ldi r22, 3", "call g", "sts 302, r28", "ret"][..],
        &["ldi r24, 1", "call g", "sts 302, r28", "ret"],
        &["ldi r24, 1", "ldi r22, 2", "call h", "sts 302, r28", "ret"],
        &["ldi r24, 1", "ldi r22, 2", "sts 302, r28", "ret"],
        &["ldi r24, 1", "ldi r22, 2", "call g", "call g", "sts 302, r28", "ret"],
    ] {
        let refusal = refused(&original, &text(wrong));
        assert!(matches!(refusal, SqueezeRefusal::Difference(_)), "{wrong:?}: {refusal}");
    }
}

#[test]
fn time_that_counts_is_compared() {
    let original = ["in r0, 63", "cli", "sts 300, r24", "out 63, r0", "ret"];
    let wrong = ["in r0, 63", "cli", "nop", "sts 300, r24", "out 63, r0", "ret"];
    assert_eq!(cause(&original, &wrong), DifferenceKind::Later { original: 2, squeezed: 3 });
    assert_eq!(
        cause(
            &["sts 96, r24", "sts 96, r25", "ret"],
            &["sts 96, r24", "nop", "nop", "nop", "sts 96, r25", "ret"]
        ),
        DifferenceKind::Later { original: 2, squeezed: 5 }
    );
    // Elsewhere the code may take longer.
    let texts = [&["sts 300, r24", "ret"][..], &["nop", "sts 300, r24", "ret"]];
    let [original, slower] = texts.map(|lines| function("f", lines));
    assert!(prove(&original, &slower, &squeeze(&original, |_| true).contracts).is_ok());
}

#[test]
fn what_no_function_has_stays_word_for_word() {
    let text = |data: &str| {
        format!("{}\t.section\t.data,\"aw\"\na:\n\t.byte\t{data}\n", function("f", &["ret"]))
    };
    assert_eq!(refused(&text("1"), &text("2")), SqueezeRefusal::Section(".data".to_owned()));
    let two = [function("f", &["ret"]), function("g", &["ret"])].concat();
    assert!(matches!(refused(&two, &function("f", &["ret"])), SqueezeRefusal::Section(_)));
    let by_hand = |line| function("f", &[";APP", line, ";NO_APP", "ret"]);
    assert_eq!(refused(&by_hand("nop"), &by_hand("wdr")), SqueezeRefusal::Assembly("f".to_owned()));
}

#[test]
fn a_condition_that_no_input_meets_is_steered() {
    // Zero is never one.
    let code = |address| {
        let store = format!("sts {address}, r24");
        function("f", &["clr r24", "cpi r24, 1", "brne .L1", &store, ".L1:", "ret"])
    };
    let report = prove(&code(300), &code(300), &squeeze(&code(300), |_| true).contracts).unwrap();
    assert_eq!((report.outcomes, report.steered), (2, 1));
    let refusal = refused(&code(300), &code(301));
    assert!(matches!(refusal, SqueezeRefusal::Difference(_)), "{refusal}");
}

#[test]
fn a_branch_that_the_original_lacks_is_refused() {
    let more = ["clr r24", "cpi r24, 1", "brne .L1", "sts 300, r24", ".L1:", "ret"];
    let refusal = refused(&function("f", &["clr r24", "ret"]), &function("f", &more));
    assert!(
        matches!(refusal, SqueezeRefusal::Unreached { line: 7, is_squeezed: true, .. }),
        "{refusal}"
    );
}

#[test]
fn each_side_of_each_branch_is_compared() {
    // The inputs depend on the symbols; none makes ten loads equal to ten constants by chance.
    let numbers = 10..20;
    let chain = |last: &str| {
        let mut code: Vec<String> = Vec::new();
        for number in numbers.clone() {
            let load = format!("lds r24, {}", 300 + number);
            code.extend([load, format!("cpi r24, {number}"), "brne .L1".to_owned()]);
        }
        code.extend([last, ".L1:", "ret"].map(str::to_owned));
        code
    };
    for name in ["f", "g", "h", "i", "j", "k", "l", "m"] {
        let text = |last| {
            let code = chain(last);
            function(name, &code.iter().map(String::as_str).collect::<Vec<_>>())
        };
        proved(&text("sts 299, r22"));
        let refusal = refused(&text("sts 299, r22"), &text("sts 299, r23"));
        assert!(matches!(refusal, SqueezeRefusal::Difference(_)), "{refusal}");
    }
}

#[test]
fn values_that_were_never_set_may_differ() {
    // r23 is a result in one case of two, and Z holds nothing when the function begins.
    let save = ["push r16", "push r17", "push r28", "push r29", "mov r16, r24"];
    let restore = ["pop r29", "pop r28", "pop r17", "pop r16", "ret"];
    let code = |either: &'static str| {
        let body = ["tst r24", "brmi .L1", "lds r30, 300", either, "mov r23, r30"];
        function("f", &[&save, &body[..], &restore].concat())
    };
    proved(&code(".L1:"));
    let end = |line| function("f", &["lds r30, 300", line, "ret"]);
    let is_proved = |original, other| {
        prove(&end(original), &end(other), &squeeze(&end(original), |_| true).contracts).is_ok()
    };
    assert!(is_proved("mov r23, r0", "mov r23, r16"));
    assert!(is_proved("mov r23, r0", "nop"));
    assert!(!is_proved("mov r23, r30", "mov r23, r31"));
    assert!(!is_proved("mov r23, r22", "mov r23, r0"));
}

#[test]
fn a_saved_register_that_assembly_reads_is_an_argument() {
    // A boot loader leaves the cause of the reset in r2. The inputs depend on the names.
    for name in ["f", "g", "h", "i", "j", "k", "l", "m"] {
        let read = [";APP", "mov r24, r2", ";NO_APP", "andi r24, 8", "call use", "ret"];
        let inner = function(&format!("{name}_inner"), &read);
        let call = format!("call {name}_inner");
        proved(&[function(name, &[&call, "ret"]), inner].concat());
    }
}

#[test]
fn code_behind_a_long_loop_is_reached() {
    // The loop ends with one of the last instructions before the limit of an execution. Zero never
    // equals one, so the store is only reached by steering.
    for rounds in 740..760 {
        let (low, high) = (format!("ldi r24, lo8({rounds})"), format!("ldi r25, hi8({rounds})"));
        let count = [&*low, &high, ".L1:", "sbiw r24, 1", "brne .L1"];
        let behind = ["cpi r24, 1", "brne .L2", "sts 300, r24", ".L2:", "ret"];
        proved(&function("f", &[&count[..], &behind[..]].concat()));
    }
}
