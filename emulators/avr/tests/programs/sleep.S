; Sleeps deeply until the watchdog interrupts, with timer 1 running; then lightly until timer 0 does. Then forgets the
; watchdog, which resets it. After that it sleeps for ever.
#define __SFR_OFFSET 0
#include <avr/io.h>
#define woken 0x100
#define passed 0x101
#define ticks 0x103
#define cause 0x104
    jmp start
.org 6 * 4
    jmp watchdog
.org 16 * 4
    jmp tick
.org 26 * 4
watchdog:
    lds r16, woken
    inc r16
    sts woken, r16
    reti
tick:
    lds r16, ticks
    inc r16
    sts ticks, r16
    reti
start:
    clr r1
    in r17, MCUSR
    out MCUSR, r1
    sts cause, r17
    sbrc r17, WDRF
    rjmp last
    ; 64 ms, interrupt only.
    ldi r16, (1 << WDCE) | (1 << WDE)
    sts WDTCSR, r16
    ldi r16, (1 << WDIE) | (1 << WDP1)
    sts WDTCSR, r16
    ldi r16, (1 << CS12) | (1 << CS10)
    sts TCCR1B, r16
    sei
    ldi r16, (1 << SM1) | (1 << SE)
    out SMCR, r16
    sleep
    lds r16, TCNT1L
    sts passed, r16
    lds r16, TCNT1H
    sts passed + 1, r16
    ; Reset only, after 16 ms; meanwhile two ticks of 2 ms.
    cli
    wdr
    ldi r16, (1 << WDCE) | (1 << WDE)
    sts WDTCSR, r16
    ldi r16, 1 << WDE
    sts WDTCSR, r16
    ldi r16, 1 << TOIE0
    sts TIMSK0, r16
    ldi r16, (1 << CS01) | (1 << CS00)
    out TCCR0B, r16
    ldi r16, 1 << SE
    out SMCR, r16
    sei
    sleep
    sleep
    cli
1:  rjmp 1b
last:
    ldi r16, (1 << WDCE) | (1 << WDE)
    sts WDTCSR, r16
    sts WDTCSR, r1
    ldi r16, (1 << SM1) | (1 << SE)
    out SMCR, r16
    cli
    sleep
1:  rjmp 1b
