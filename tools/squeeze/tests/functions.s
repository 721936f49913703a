; Functions as LLVM writes them, one for each case that the images of this repository do not have.

; The sum is not read, its carry is.
	.section	.text.carry_of_adc,"ax",@progbits
	.globl	carry_of_adc
	.type	carry_of_adc,@function
carry_of_adc:
.Lfunc_begin0:
	mov	r26, r24
	add	r26, r22
	adc	r25, r23
	mov	r24, r25
	ret
.Lfunc_end0:
	.size	carry_of_adc, .Lfunc_end0-carry_of_adc

; The low byte is not read, its borrow is.
	.section	.text.carry_of_sbci,"ax",@progbits
	.globl	carry_of_sbci
	.type	carry_of_sbci,@function
carry_of_sbci:
.Lfunc_begin1:
	subi	r24, 5
	sbci	r25, 0
	mov	r24, r25
	ret
.Lfunc_end1:
	.size	carry_of_sbci, .Lfunc_end1-carry_of_sbci

; Only a branch on the carry reads the comparison.
	.section	.text.flag_of_brcs,"ax",@progbits
	.globl	flag_of_brcs
	.type	flag_of_brcs,@function
flag_of_brcs:
.Lfunc_begin2:
	cp	r24, r22
	inc	r20
	brcs	.Lcarry
	ldi	r24, 1
	ret
.Lcarry:
	ldi	r24, 2
	ret
.Lfunc_end2:
	.size	flag_of_brcs, .Lfunc_end2-flag_of_brcs

; Only the high byte of a copied pair is read, when its source is gone.
	.section	.text.high_half_of_movw,"ax",@progbits
	.globl	high_half_of_movw
	.type	high_half_of_movw,@function
high_half_of_movw:
.Lfunc_begin3:
	movw	r18, r24
	lds	r25, 300
	lds	r24, 301
	add	r24, r19
	ret
.Lfunc_end3:
	.size	high_half_of_movw, .Lfunc_end3-high_half_of_movw

; A constant that is computed from another.
	.section	.text.constant_of_andi,"ax",@progbits
	.globl	constant_of_andi
	.type	constant_of_andi,@function
constant_of_andi:
.Lfunc_begin4:
	ldi	r24, 12
	andi	r24, 10
	ret
.Lfunc_end4:
	.size	constant_of_andi, .Lfunc_end4-constant_of_andi

; Another one.
	.section	.text.constant_of_ori,"ax",@progbits
	.globl	constant_of_ori
	.type	constant_of_ori,@function
constant_of_ori:
.Lfunc_begin5:
	ldi	r24, 12
	ori	r24, 10
	ret
.Lfunc_end5:
	.size	constant_of_ori, .Lfunc_end5-constant_of_ori

; Zero is known from before, the sign of the comparison is not.
	.section	.text.two_branches,"ax",@progbits
	.globl	two_branches
	.type	two_branches,@function
two_branches:
.Lfunc_begin6:
	inc	r24
	cpi	r24, 0
	breq	.Lnot_above
	brlt	.Lnot_above
	ldi	r24, 1
	ret
.Lnot_above:
	ldi	r24, 2
	ret
.Lfunc_end6:
	.size	two_branches, .Lfunc_end6-two_branches

; The instruction that sets Z may be skipped.
	.section	.text.skipped_zero,"ax",@progbits
	.globl	skipped_zero
	.type	skipped_zero,@function
skipped_zero:
.Lfunc_begin7:
	sbrc	r22, 0
	inc	r24
	cpi	r24, 0
	breq	.Lzero
	ldi	r24, 1
	ret
.Lzero:
	ldi	r24, 2
	ret
.Lfunc_end7:
	.size	skipped_zero, .Lfunc_end7-skipped_zero

; WDTCSR wants its second write within four cycles.
	.section	.text.timed_writes,"ax",@progbits
	.globl	timed_writes
	.type	timed_writes,@function
timed_writes:
.Lfunc_begin8:
	lds	r18, 300
	lds	r19, 301
	ldi	r20, 24
	sts	96, r20
	sts	96, r25
	inc	r21
	lds	r18, 300
	lds	r19, 301
	ldi	r20, 24
	sts	96, r20
	sts	96, r22
	inc	r21
	lds	r18, 300
	lds	r19, 301
	ldi	r20, 24
	sts	96, r20
	sts	96, r23
	inc	r21
	sts	302, r21
	ret
.Lfunc_end8:
	.size	timed_writes, .Lfunc_end8-timed_writes

; A section without interrupts, four times.
	.section	.text.interrupts_off,"ax",@progbits
	.globl	interrupts_off
	.type	interrupts_off,@function
interrupts_off:
.Lfunc_begin9:
	cli
	lds	r24, 300
	lds	r25, 301
	adiw	r24, 1
	sts	300, r24
	sts	301, r25
	sei
	inc	r18
	cli
	lds	r24, 300
	lds	r25, 301
	adiw	r24, 1
	sts	300, r24
	sts	301, r25
	sei
	inc	r19
	cli
	lds	r24, 300
	lds	r25, 301
	adiw	r24, 1
	sts	300, r24
	sts	301, r25
	sei
	inc	r20
	cli
	lds	r24, 300
	lds	r25, 301
	adiw	r24, 1
	sts	300, r24
	sts	301, r25
	sei
	inc	r21
	sts	302, r18
	sts	303, r19
	sts	304, r20
	sts	305, r21
	ret
.Lfunc_end9:
	.size	interrupts_off, .Lfunc_end9-interrupts_off

; Pulses whose cycles an author has counted, four times.
	.section	.text.pulses,"ax",@progbits
	.globl	pulses
	.type	pulses,@function
pulses:
.Lfunc_begin10:
	;APP
	sbi	5, 1
	nop
	nop
	cbi	5, 1
	;NO_APP
	inc	r18
	;APP
	sbi	5, 1
	nop
	nop
	cbi	5, 1
	;NO_APP
	inc	r19
	;APP
	sbi	5, 1
	nop
	nop
	cbi	5, 1
	;NO_APP
	inc	r20
	;APP
	sbi	5, 1
	nop
	nop
	cbi	5, 1
	;NO_APP
	inc	r21
	sts	302, r18
	sts	303, r19
	sts	304, r20
	sts	305, r21
	ret
.Lfunc_end10:
	.size	pulses, .Lfunc_end10-pulses

; An argument on the stack.
	.section	.text.reads_stack,"ax",@progbits
	.type	reads_stack,@function
reads_stack:
.Lfunc_begin11:
	push	r28
	push	r29
	in	r28, 61
	in	r29, 62
	ldd	r24, Y+5
	sts	300, r24
	pop	r29
	pop	r28
	ret
.Lfunc_end11:
	.size	reads_stack, .Lfunc_end11-reads_stack

; The first instruction pushes an argument for another function.
	.section	.text.pushed_argument,"ax",@progbits
	.type	pushed_argument,@function
pushed_argument:
.Lfunc_begin12:
	push	r24
	call	reads_stack
	pop	r0
	ret
.Lfunc_end12:
	.size	pushed_argument, .Lfunc_end12-pushed_argument

	.section	.text.caller_of_pushed_argument,"ax",@progbits
	.globl	caller_of_pushed_argument
	.type	caller_of_pushed_argument,@function
caller_of_pushed_argument:
.Lfunc_begin13:
	ldi	r24, 5
	call	pushed_argument
	ret
.Lfunc_end13:
	.size	caller_of_pushed_argument, .Lfunc_end13-caller_of_pushed_argument

; Assembly that only reads flash, four times: it is shared.
	.section	.text.from_flash,"ax",@progbits
	.globl	from_flash
	.type	from_flash,@function
from_flash:
.Lfunc_begin14:
	movw	r30, r24
	;APP
	lpm	r0, Z+
	lpm	r31, Z
	mov	r30, r0
	;NO_APP
	sts	300, r30
	sts	301, r31
	movw	r30, r22
	;APP
	lpm	r0, Z+
	lpm	r31, Z
	mov	r30, r0
	;NO_APP
	sts	300, r30
	sts	301, r31
	movw	r30, r20
	;APP
	lpm	r0, Z+
	lpm	r31, Z
	mov	r30, r0
	;NO_APP
	sts	300, r30
	sts	301, r31
	movw	r30, r18
	;APP
	lpm	r0, Z+
	lpm	r31, Z
	mov	r30, r0
	;NO_APP
	sts	300, r30
	sts	301, r31
	ret
.Lfunc_end14:
	.size	from_flash, .Lfunc_end14-from_flash

; The handler of an interrupt does not find zero in r1.
	.section	.text.__vector_3,"ax",@progbits
	.globl	__vector_3
	.type	__vector_3,@function
__vector_3:
.Lfunc_begin15:
	push	r1
	push	r24
	ldi	r24, 0
	sts	301, r24
	pop	r24
	pop	r1
	reti
.Lfunc_end15:
	.size	__vector_3, .Lfunc_end15-__vector_3

; What a boot loader has left in r2.
	.section	.text.boot_flags,"ax",@progbits
	.globl	boot_flags
	.type	boot_flags,@function
boot_flags:
.Lfunc_begin16:
	;APP
	mov	r24, r2
	;NO_APP
	andi	r24, 8
	call	outside
	ret
.Lfunc_end16:
	.size	boot_flags, .Lfunc_end16-boot_flags
