/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_EMBED_H
#define PEN_SERVER_EMBED_H

/*
 * Puts a file of the source tree into the program, as the hidden symbols NAME, its bytes, and
 * NAME_size, their number as a uint64_t. The assembler finds files as the compiler finds headers:
 * from the root of the tree. The object must depend on the file; see server/CMakeLists.txt.
 */
#define PEN_EMBED(name, path)                                                                      \
	__asm__(".pushsection .rodata\n.balign 8\n"                                                \
		".globl " name "\n.hidden " name "\n"                                              \
		".globl " name "_size\n.hidden " name "_size\n" name "_size: .quad 1f - 0f\n" name \
		":\n0:\n.incbin \"" path "\"\n1:\n.popsection\n")

#endif
