/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_CAMERA_H
#define PEN_RENDER_CAMERA_H

#include "core/base/error.h"
#include "core/render/vec.h"
#include "core/scene/desc.h"

#include <stdbool.h>
#include <stdint.h>

/*
 * One key to the next: position linear, orientation by slerp, written as
 * cos(a) from + sin(a) toward with a = s * angle, which needs no division.
 */
struct pen_camera_segment {
	float start, inv_length; /* fractions of the shutter; s = (time - start) * inv_length */
	struct pen_vec3 position, step;
	float from[4], toward[4]; /* orthogonal quaternions, x y z w */
	float angle_turns;	  /* half the rotation's angle */
};

/* Axes of length 1. */
struct pen_camera_frame {
	struct pen_vec3 position, right, up, forward;
};

/* A thin lens. Pixel (0, 0) is top left, its centre at film position (0.5, 0.5). */
struct pen_camera {
	struct pen_camera_frame frame; /* when the shutter opens */
	float tan_x, tan_y;	       /* of half the field of view; or half the view itself */
	bool is_orthographic;	       /* the lens is then as large for each pixel */
	float pixel_x, pixel_y;	       /* a pixel's share of half the film */
	float aperture_radius;
	float inv_focus; /* 1 / focus distance; 0 for a pinhole */
	enum pen_focal_surface focal_surface;
	uint32_t blades;   /* 0 = round; corners lie on the circle of the aperture's radius */
	float blade_turns; /* the first corner, counter-clockwise from right, in [0, 1) */
	struct pen_camera_segment *segments;
	uint32_t segment_count; /* 0 = no motion within the shutter */
};

/* desc must be valid. PEN_ENOMEM. */
int pen_camera_init(struct pen_camera *camera, const struct pen_camera_desc *desc, uint32_t width,
	uint32_t height, struct pen_error *err);
void pen_camera_finish(struct pen_camera *camera);

/* Structure of arrays, all of n floats: rays with directions of length 1. */
struct pen_camera_rays {
	float *origin_x, *origin_y, *origin_z;
	float *direction_x, *direction_y, *direction_z;
};

/*
 * Rays of n samples: film position in pixels of the whole image, lens (u, v) in [0,1), time in
 * [0,1] as a fraction of the shutter. A pinhole ignores the lens; whitted's lens centre is a
 * camera of aperture radius 0.
 */
void pen_camera_generate(const struct pen_camera *camera, uint32_t n, const float *film_x,
	const float *film_y, const float *lens_u, const float *lens_v, const float *time,
	const struct pen_camera_rays *ret_rays);

/* The view axis at a time, a fraction of the shutter. */
struct pen_vec3 pen_camera_axis(const struct pen_camera *camera, float time);

#endif
