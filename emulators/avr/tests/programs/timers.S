; Counts what timers 0 (kilolib's tick) and 2 (its motors' rate) do, and how long an interrupt of timer 1 takes to be entered.
#define __SFR_OFFSET 0
#include <avr/io.h>
#define ticks 0x100
#define overflows 0x102
#define entered 0x104
#define late 0x106

.macro count where
    push r16
    in r16, SREG
    push r16
    lds r16, \where
    inc r16
    sts \where, r16
    brne 1f
    lds r16, \where + 1
    inc r16
    sts \where + 1, r16
1:  pop r16
    out SREG, r16
    pop r16
    reti
.endm

    jmp start
.org 9 * 4
    jmp overflow
.org 11 * 4
    jmp compare
.org 14 * 4
    jmp tick
.org 26 * 4
overflow:
    count overflows
tick:
    count ticks
compare:
    lds r20, TCNT1L
    lds r21, TCNT1H
    sts entered, r20
    sts entered + 1, r21
    reti
start:
    clr r1
    ; As the oscillator was calibrated; a reset leaves it beside that.
    ldi r16, 0x9c
    sts OSCCAL, r16
    ldi r16, 255
    out OCR0A, r16
    ldi r16, (1 << CS02) | (1 << CS00)
    out TCCR0B, r16
    ldi r16, 1 << OCIE0A
    sts TIMSK0, r16
    ldi r16, (1 << COM2A1) | (1 << COM2B1) | (1 << WGM20)
    sts TCCR2A, r16
    ldi r16, 1 << CS21
    sts TCCR2B, r16
    ldi r16, 1 << TOIE2
    sts TIMSK2, r16
    ; Timer 1 reaches 100 while nothing but `nop` is executed.
    sts OCR1AH, r1
    ldi r16, 100
    sts OCR1AL, r16
    ldi r16, 1 << OCIE1A
    sts TIMSK1, r16
    ldi r16, 1 << CS10
    sts TCCR1B, r16
    sei
.rept 150
    nop
.endr
    sts TIMSK1, r1
    ; The flag of an interrupt that is masked by its bit is seen by looking, and cleared by a one; SBI clears no other.
    ldi r16, 0xff
    out TIFR1, r16
    sts OCR1BH, r1
    sts OCR1BL, r1
    sts TCNT1H, r1
    sts TCNT1L, r1
.rept 120
    nop
.endr
    sbi TIFR1, OCF1A
    in r16, TIFR1
    sts late, r16
1:  rjmp 1b
