/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_GATE_H
#define PEN_SERVER_GATE_H

#include "server/exchange.h"

/* What stands before every handler: from where a request comes, and who sent it. */

/*
 * Whether the exchange may go on, as far as its fields tell: by its Host, its Origin, and its token
 * if scope (of enum pen_scope) is not open to everybody. One that came in by a socket in the file
 * system needs neither Host nor Origin of ours, nor a token when it is its owner's. Fills
 * exchange->caller. Answers nothing.
 */
enum pen_gate pen_gate_check(struct pen_exchange *exchange, unsigned scope);

/* Whether it takes a token to come in the way that this one did, but for what is open to everybody.
 */
bool pen_gate_asks_for_token(const struct pen_exchange *exchange);

/* Answers an exchange that may not go on. */
void pen_gate_refuse(struct pen_exchange *exchange);

#endif
