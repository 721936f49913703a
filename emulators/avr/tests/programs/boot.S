; An application that tries to write flash, which it may not, and then starts the boot loader at 0x7000: that moves the vectors,
; writes page 0x1000 with 0x1234, 0x1235, ... and calls what it has written there: `ret` is its last word.
#define __SFR_OFFSET 0
#include <avr/io.h>
#define ticks 0x100
#define returned 0x101
    jmp start
.org 26 * 4
start:
    clr r1
    clr r30
    ldi r31, 0x10
    ldi r16, (1 << PGERS) | (1 << SELFPRGEN)
    out SPMCSR, r16
    spm
    jmp boot

.section .boot, "ax"
boot_vectors:
    jmp boot
.org 16 * 4
    jmp tick
.org 26 * 4
tick:
    lds r17, ticks
    inc r17
    sts ticks, r17
    reti
boot:
    ldi r16, 1 << IVCE
    out MCUCR, r16
    ldi r16, 1 << IVSEL
    out MCUCR, r16
    ldi r16, 1 << TOIE0
    sts TIMSK0, r16
    ldi r16, 1 << CS01
    out TCCR0B, r16
    sei
    clr r30
    ldi r31, 0x10
    ldi r18, (1 << PGERS) | (1 << SELFPRGEN)
    rcall store
    ldi r20, 0x34
    ldi r21, 0x12
    ldi r19, 63
1:  mov r0, r20
    mov r1, r21
    ldi r18, 1 << SELFPRGEN
    rcall store
    subi r20, 0xff
    sbci r21, 0xff
    adiw r30, 2
    dec r19
    brne 1b
    ldi r20, 0x08
    ldi r21, 0x95
    movw r0, r20
    ldi r18, 1 << SELFPRGEN
    rcall store
    ldi r18, (1 << PGWRT) | (1 << SELFPRGEN)
    rcall store
    ldi r18, (1 << RWWSRE) | (1 << SELFPRGEN)
    rcall store
    call 0x107e
    ldi r16, 1
    sts returned, r16
2:  rjmp 2b
; SPMCSR = r18, then SPM in time, then until it is done.
store:
    cli
    out SPMCSR, r18
    spm
    sei
1:  in r16, SPMCSR
    sbrc r16, SELFPRGEN
    rjmp 1b
    ret
