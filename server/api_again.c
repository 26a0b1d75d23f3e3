/* SPDX-License-Identifier: Apache-2.0 */
#include "server/api_again.h"

#include "server/content.h"
#include "server/fields.h"

#include <string.h>

enum { KEY_MAX = 255 };

int pen_api_again_read_key(const struct pen_exchange *exchange, struct pen_submission *submission,
	struct pen_error *err)
{
	const char *key = pen_exchange_field(exchange, "Idempotency-Key");
	const size_t length = key ? strlen(key) : 0;
	struct pen_sha256 digest;
	int r;

	if (!key)
		return 0;
	if (length == 0 || length > KEY_MAX)
		return pen_error_set(
			err, PEN_EINVALID, "an Idempotency-Key has from 1 to 255 characters");
	submission->has_key = true;
	r = pen_sha256_of(key, length, &digest, err);
	return r == 0 ? pen_owner_mix(&exchange->caller.owner, &digest, &submission->key, err) : r;
}

static bool find_key(struct pen_exchange *exchange, const struct pen_submission *submission,
	struct pen_job **ret_job)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_answer answer;
	struct pen_job *job;

	switch (pen_jobs_find_key(exchange->api->jobs, &submission->key, &job, &err)) {
	case 0:
		if (pen_sha256_equal(&job->key_body, &submission->key_body)) {
			*ret_job = job;
			return true;
		}
		pen_exchange_problem(exchange, 422,
			"something else was asked for with this Idempotency-Key before");
		return false;
	case PEN_EAGAIN:
		pen_answer_problem(&answer, 409, err.text);
		pen_answer_field(&answer, "Retry-After", "1");
		pen_exchange_answer(exchange, &answer);
		return false;
	default: return true;
	}
}

/* What a worker that is here would make, bit for bit. */
static struct pen_job *find_content(
	const struct pen_exchange *exchange, const struct pen_submission *submission)
{
	const struct pen_api *api = exchange->api;
	const struct pen_worker *worker = NULL;
	struct pen_job *job = NULL;
	struct pen_sha256 content;

	while (!job && (worker = pen_farm_next(api->farm, worker ? worker->id : 0)) != NULL)
		if (pen_content_of(
			    &submission->sha256, worker->equivalence_class, &content, NULL) == 0)
			job = pen_jobs_find_content(api->jobs, &exchange->caller.owner, &content);
	/* One that was looked at less closely than is asked for now is another one. */
	return job && job->verify >= submission->verify ? job : NULL;
}

bool pen_api_again_find(struct pen_exchange *exchange, const struct pen_submission *submission,
	struct pen_job **ret_job)
{
	const char *control = pen_exchange_field(exchange, "Cache-Control");

	*ret_job = NULL;
	if (submission->has_key && !find_key(exchange, submission, ret_job))
		return false;
	if (!*ret_job && !pen_field_has_directive(control, "no-store"))
		*ret_job = find_content(exchange, submission);
	return true;
}
