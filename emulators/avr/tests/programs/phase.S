; What an image keeps of its script: global code, init(), two steps, a step in two turns, and one that is never completed. Each phase
; lasts for a turn, which begins with `wdr`.
#define phase 0x104
.global bbz_phase
.set bbz_phase, 0x800000 + phase
    ldi r30, lo8(phases)
    ldi r31, hi8(phases)
    ldi r17, 12
1:  wdr
    lpm r16, Z+
    sts phase, r16
    dec r17
    brne 1b
2:  wdr
    rjmp 2b
phases:
    .byte 0, 1, 2, 3, 2, 3, 2, 3, 2, 2, 3, 2
