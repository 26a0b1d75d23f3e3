/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_API_IMAGE_H
#define PEN_SERVER_API_IMAGE_H

#include "server/api.h"

/* GET of /v1/renders/{id}/image, image.{extension}, and the frames. */
void pen_api_image_get(struct pen_exchange *exchange, const struct pen_api_parameters *parameters);

/* The colour of a frame as the scene would have it shown; job and frame must outlive it. */
struct pen_encoding pen_api_image_encoding(
	const struct pen_job *job, const struct pen_job_frame *frame);

struct pen_api_image_manner {
	bool is_negotiated; /* another Accept gets another image */
	bool is_shared;	    /* pages of other sites may read it */
};

/* Answers with such an image, now or when it has been encoded, or tells why there is none. */
void pen_api_image_answer(struct pen_exchange *exchange, const struct pen_job *job,
	const struct pen_job_frame *frame, const struct pen_encoding *encoding,
	struct pen_api_image_manner manner);

#endif
