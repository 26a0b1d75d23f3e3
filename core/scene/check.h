/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SCENE_CHECK_H
#define PEN_SCENE_CHECK_H

#include "core/scene/reader.h"

/*
 * What a scene must be beyond the ranges of its numbers: geometry that is not degenerate, numbers
 * that fit each other. Each check gets an object whose members are all
 * good and its description, which it completes where a default follows from other members.
 */
void pen_check_image(
	struct pen_reader *reader, const struct pen_place *at, json_t *image, void *desc);
void pen_check_shutter(
	struct pen_reader *reader, const struct pen_place *at, json_t *shutter, void *camera_desc);

/* Completes the camera as well, unless it is one of a glTF's, which is not known here. */
void pen_check_camera(
	struct pen_reader *reader, const struct pen_place *at, json_t *camera, void *desc);

void pen_check_adaptive(
	struct pen_reader *reader, const struct pen_place *at, json_t *sampling, void *desc);
void pen_check_background(
	struct pen_reader *reader, const struct pen_place *at, json_t *background, void *desc);
void pen_check_frames(
	struct pen_reader *reader, const struct pen_place *at, json_t *frames, void *desc);

/* Normalises the rotation too. */
void pen_check_pose(
	struct pen_reader *reader, const struct pen_place *at, json_t *pose, void *desc);
void pen_check_pose_key(
	struct pen_reader *reader, const struct pen_place *at, json_t *key, void *desc);

/* The keyframes of any object. */
void pen_check_object(
	struct pen_reader *reader, const struct pen_place *at, json_t *object, void *desc);

void pen_check_rectangle(
	struct pen_reader *reader, const struct pen_place *at, json_t *light, void *desc);
void pen_check_triangle(
	struct pen_reader *reader, const struct pen_place *at, json_t *light, void *desc);
/* These make normal and direction unit vectors. */
void pen_check_disk(
	struct pen_reader *reader, const struct pen_place *at, json_t *light, void *desc);
void pen_check_spot(
	struct pen_reader *reader, const struct pen_place *at, json_t *light, void *desc);
void pen_check_directional(
	struct pen_reader *reader, const struct pen_place *at, json_t *light, void *desc);

/* Times of a list of keys rise strictly; each key begins with its time and has size bytes. */
void pen_check_times(struct pen_reader *reader, const struct pen_place *at, json_t *list,
	const void *keys, size_t size);

/* The whole scene: the samples of the render, the size of the tree. Passes over what is not good.
 */
void pen_check_scene(struct pen_reader *reader, const struct pen_place *at, json_t *tree);

#endif
