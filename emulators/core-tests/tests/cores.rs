//! Which core passes which test. Needs qemu-system-arm.

use bittybuzz_cortex_m0::CortexM0;
use bittybuzz_qemu::QemuCore;
use bittybuzz_unicorn::UnicornCore;
use bittybuzz_zooids_board::ZooidBoard;

macro_rules! tests {
    ($core:ty: $($test:ident),* $(,)?) => {
        $(
            #[test]
            fn $test() {
                bittybuzz_core_tests::$test::<$core>();
            }
        )*
    };
}

mod own {
    use super::*;

    tests! {
        CortexM0<ZooidBoard>:
        instructions_take_the_manuals_cycles,
        a_line_that_is_longer_than_any_budget_is_executed_too,
        several_registers_go_to_memory_and_come_back,
        more_urgent_interrupts_nest_and_equal_ones_wait,
        an_unaligned_access_is_a_hard_fault_and_a_second_fault_a_lockup,
        a_fault_in_the_hard_fault_handler_locks_up,
        a_full_stack_is_a_hard_fault,
        the_watchdog_ends_a_lockup,
        a_page_is_erased_and_programmed,
        self_modified_code_is_executed,
        instructions_that_armv6m_lacks_are_hard_faults,
        priorities_have_two_bits_and_vtor_does_not_exist,
    }
}

/// It does accesses that are not aligned.
mod unicorn {
    use super::*;

    tests! {
        UnicornCore<'static, ZooidBoard>:
        several_registers_go_to_memory_and_come_back,
        more_urgent_interrupts_nest_and_equal_ones_wait,
        a_fault_in_the_hard_fault_handler_locks_up,
        a_full_stack_is_a_hard_fault,
        the_watchdog_ends_a_lockup,
        a_page_is_erased_and_programmed,
        self_modified_code_is_executed,
        instructions_that_armv6m_lacks_are_hard_faults,
        priorities_have_two_bits_and_vtor_does_not_exist,
    }
}

/// A Cortex-M3, whose flash the firmware cannot change, and whose accesses below the RAM the bridge takes for the chip's identity.
mod qemu {
    use super::*;

    tests! {
        QemuCore<ZooidBoard>:
        several_registers_go_to_memory_and_come_back,
        more_urgent_interrupts_nest_and_equal_ones_wait,
        a_fault_in_the_hard_fault_handler_locks_up,
        the_watchdog_ends_a_lockup,
    }
}
