/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_BASE_LIMITS_H
#define PEN_BASE_LIMITS_H

#include "core/base/film.h"

/* Every bound on what comes from outside. Each has a test at N-1, N and N+1. */

/* Scene text */
#define PEN_SCENE_BYTES_MAX  (8u << 20)
#define PEN_SCENE_DEPTH_MAX  32u
#define PEN_SCENE_NODES_MAX  1000000u
#define PEN_SCENE_NODE_BYTES 256u /* of memory, at most, beside the bytes of its texts */
#define PEN_SCENE_STRING_MAX 4096u
#define PEN_SCENE_ERRORS_MAX 64u /* reported in one answer */
#define PEN_SCENE_MEMORY_MAX (512ul << 20)

/* What is told of a scene */
#define PEN_SCENE_ERROR_BYTES_MAX   255u /* of a pointer, and of a detail */
#define PEN_SCENE_WARNINGS_MAX	    64u
#define PEN_SCENE_WARNING_BYTES_MAX 511u

/* What a scene may ask for */
#define PEN_COORDINATE_MAX     1e15
#define PEN_SCALE_MIN	       1e-6 /* two scales cubed stay within float */
#define PEN_SCALE_MAX	       1e6
#define PEN_TIME_MAX	       1e6 /* seconds */
#define PEN_IMAGE_SIDE_MAX     16384u
#define PEN_IMAGE_PIXELS_MAX   134217728u
#define PEN_SAMPLES_MAX	       65536u
#define PEN_FRAME_SAMPLES_MAX  (1ull << 40)
#define PEN_JOB_SAMPLES_MAX    (1ull << 50) /* of all frames; JSON numbers hold them exactly */
#define PEN_DEPTH_MAX	       64u
#define PEN_WHITTED_DEPTH_MAX  12u
#define PEN_OBJECTS_MAX	       65536u
#define PEN_LIGHTS_MAX	       65536u
#define PEN_MATERIALS_MAX      65536u
#define PEN_NODES_MAX	       262144u
#define PEN_KEYFRAMES_MAX      4096u
#define PEN_BLADES_MAX	       32u
#define PEN_FILTER_WIDTH_MAX   32.0
#define PEN_ASSETS_MAX	       4096u /* mentions of files in a scene text */
#define PEN_ASSET_BYTES_MAX    (1ull << 30)
#define PEN_TEXTURES_MAX       2048u
#define PEN_PATTERN_MAX	       16u /* side of a block of pixels */
#define PEN_FRAMES_MAX	       100000u
#define PEN_FRAME_NUMBER_MAX   1000000u
#define PEN_FRAME_RATE_MIN     0.001
#define PEN_FRAME_RATE_MAX     1000.0
#define PEN_GEOMETRY_BYTES_MAX (4ul << 30) /* of one kind: vertices, indices, … */

/* Light */
#define PEN_EMITTERS_MAX	   (1u << 20) /* triangles and spheres that send out light, of a frame */
#define PEN_EMITTER_CANDIDATES_MAX (1u << 24) /* the same with those that a texture makes black */
#define PEN_PANEL_TRIANGLES_MAX                                                                    \
	(1u << 17) /* of a frame, looked at for rectangles that they tile                          \
		    */

/* Pictures: what an encoded image may unfold to */
#define PEN_PICTURE_SIDE_MAX	 16384u
#define PEN_PICTURE_PIXELS_MAX	 (1u << 26)
#define PEN_PICTURE_CHANNELS_MAX 64u	     /* that are stored; four are read */
#define PEN_PICTURE_SCANS_MAX	 64u	     /* of a JPEG */
#define PEN_PICTURE_CPU_S	 20u	     /* of processor time to decode one */
#define PEN_PICTURES_BYTES_MAX	 (2ul << 30) /* decoded, all of a scene with their averages */

/* glTF assets */
#define PEN_GLTF_TEXT_BYTES_MAX	 (256u << 20)
#define PEN_GLTF_TEXT_DEPTH_MAX	 64u
#define PEN_GLTF_TEXT_VALUES_MAX 2000000u
#define PEN_GLTF_LIST_MAX	 65536u /* elements of one kind in one asset */
#define PEN_GLTF_DEPTH_MAX	 256u	/* of its node tree */
#define PEN_GLTF_MORPHS_MAX	 64u	/* targets of one mesh */
#define PEN_GLTF_WARNINGS_MAX	 64u
#define PEN_GLTF_ZEROS_MAX	 (1u << 26)  /* numbers of one asset that no bytes stand for */
#define PEN_GLTF_TEXTURES_MAX	 8192u	     /* and pictures, of a scene with all its assets */
#define PEN_GLTF_MEMORY_MAX	 (4ul << 30) /* what all assets of a scene hold, read out */

/* Tiles and rounds */
#define PEN_TILE_SIDE_MAX     256u
#define PEN_ROUND_SAMPLES_MAX 256u
#define PEN_TILE_BYTES_MAX    (PEN_TILE_SIDE_MAX * PEN_TILE_SIDE_MAX * PEN_CHANNELS_MAX * 4u)
#define PEN_MASK_BYTES_MAX    (PEN_TILE_SIDE_MAX * PEN_TILE_SIDE_MAX / 8u)

/* Wire */
#define PEN_FRAME_CONTROL_MAX (64u << 10)
#define PEN_FRAME_PAYLOAD_MAX ((4u << 20) + 4096u)
#define PEN_FRAME_UNKNOWN_MAX 16u   /* fields of a later protocol in one message */
#define PEN_REASON_MAX	      1024u /* bytes of a sentence for people */
#define PEN_WORKERS_MAX	      256u
#define PEN_PROCESSES_MAX     256u /* render processes of one worker */
#define PEN_LEASES_MAX	      (2u * PEN_PROCESSES_MAX)
#define PEN_HEARTBEAT_MS      2000
#define PEN_DEAD_MS	      10000
#define PEN_HELLO_MS	      5000
#define PEN_LEASE_MS	      10000
#define PEN_LEASE_HARD_MS     600000
#define PEN_CLASS_BYTES_MAX   95u /* of an equivalence class's text */
#define PEN_CLASS_ABSENT_MS   60000
#define PEN_BLAME_MAX	      3u
#define PEN_KILLS_MAX	      20u
#define PEN_STRIKES_MAX	      3u
#define PEN_QUARANTINE_MS     600000
#define PEN_SCENES_CACHED_MAX 8u
#define PEN_ASSETS_CACHED_MAX (2u * PEN_ASSETS_MAX)

/* Coordinator */
#define PEN_MERGING_MAX		256u	     /* results on their way into framebuffers */
#define PEN_STORE_QUEUE_MAX	4096u	     /* requests that wait for the disk */
#define PEN_SCENE_ROW_BYTES_MAX (32u << 10)  /* of a scene that stands in the database, too */
#define PEN_TILES_COMMIT_MAX	64u	     /* tile rows committed together */
#define PEN_KEEP_HOURS_MAX	87600u	     /* ten years */
#define PEN_CONFIG_LINE_MAX	4095	     /* bytes of a line of a configuration file */
#define PEN_CONFIG_LINES_MAX	10000u	     /* of a configuration file */
#define PEN_KEEP_MIB_MAX	(1u << 30)   /* a pebibyte */
#define PEN_RECENT_TEXTS_MAX	64u	     /* resources of renders, as they were answered last */
#define PEN_UNCHANGED_MAX	8u	     /* answers 304, as they were given last */
#define PEN_RECENT_BYTES_MAX	(16u << 10)  /* of one of them */
#define PEN_SHELF_TREES_MAX	8u	     /* kept scenes whose trees are at hand */
#define PEN_PREVIEWS_KEPT_MAX	64u	     /* that are over */
#define PEN_DEADLINE_S_MAX	31536000u    /* a year */
#define PEN_DISK_RESERVE_BYTES	(64ul << 20) /* kept free when a render is accepted */

/* Keys */
#define PEN_KEY_FILE_MAX    (64u << 10) /* bytes of a file of keys */
#define PEN_KEY_NAME_MAX    64u
#define PEN_BARRED_MAX	    256u /* keys of workers whose pixels were wrong */
#define PEN_TOKENS_MAX	    256u
#define PEN_GREETINGS_MAX   64u /* connections of workers that have not said who they are */
#define PEN_HOST_NAMES_MAX  64u
#define PEN_CERTIFICATE_MAX (256u << 10) /* bytes of a file of them, or of a key */
#define PEN_KEY_AGE_MS	    1000 /* how long a file of keys may have changed before that is seen */

/* HTTP */
#define PEN_HTTP_BODY_MAX	 (PEN_SCENE_BYTES_MAX + (64u << 10))
#define PEN_HTTP_CONNECTIONS_MAX 4096u
#define PEN_HTTP_LOCAL_MAX	 256u	      /* connections by the socket in the file system */
#define PEN_HTTP_MEMORY		 (16u << 10)  /* of one connection: request line and headers */
#define PEN_JOBS_QUEUED_MAX	 1000u	      /* unless the operator says otherwise, */
#define PEN_JOBS_QUEUED_CEILING	 100000u      /* up to this */
#define PEN_OWNER_JOBS_MAX	 100u	      /* of one token, that wait or are rendered */
#define PEN_OWNER_SAMPLES_MAX	 (1ull << 42) /* that they need yet */
#define PEN_SUBMIT_BURST	 20u	      /* renders that a token may ask for at once, then */
#define PEN_SUBMIT_EVERY_MS	 100	      /* one in that time */
#define PEN_RETRY_S_MAX		 3600u	      /* told to those who come too early */
#define PEN_RETRY_UNKNOWN_S	 60u	      /* when nobody knows */
#define PEN_NAME_MAX		 256u
#define PEN_TRACEPARENT_TEXT	 56 /* of the W3C's version 00, and a NUL */
#define PEN_REQUEST_ID_MAX	 64u
#define PEN_LIST_PAGE_MAX	 500u
#define PEN_HTTP_BODIES_MAX	 (256u << 20) /* of all connections together */
#define PEN_HTTP_ANSWERS_MAX	 (256u << 20) /* in memory, that clients have yet to take */
#define PEN_HTTP_IDLE_S		 15u
#define PEN_HTTP_HEADER_MS	 10000u	      /* for the whole of a request's header */
#define PEN_HTTP_GRACE_MS	 10000u	      /* before a body or an answer must keep its rate: */
#define PEN_HTTP_RATE		 1024u	      /* bytes a second */
#define PEN_HTTP_TRANSFER_MS	 900000u      /* of a body, and of an answer */
#define PEN_HTTP_ADDRESS_MAX	 256u	      /* connections; a proxy elsewhere is one address */
#define PEN_HTTP_DRAIN_MAX	 (1ull << 30) /* bytes read past an early answer */
#define PEN_HTTP_DRAIN_MS	 30000
#define PEN_WATCHES_MAX		 2048u /* clients that wait for a render to change */
#define PEN_WAIT_S_MAX		 30u
#define PEN_STREAMS_MAX		 1024u	      /* of events */
#define PEN_STREAM_TEXT_MAX	 (256u << 10) /* of one, that its client has not taken */
#define PEN_EVENT_TILES_MAX	 512u
#define PEN_EVENT_HELD_MAX	 256u /* tiles that workers are at work on */
#define PEN_METRICS_BYTES_MAX	 (1u << 20)
#define PEN_EXPOSURE_MAX	 64.0

/* What the trial of the sandbox may take at the start */
#define PEN_SANDBOX_PROBE_MS 10000

/* Encoded images */
#define PEN_ENCODINGS_WAITING_MAX 64u
#define PEN_ENCODING_MS		  60000 /* and a millisecond for each so many values: */
#define PEN_ENCODING_MS_VALUES	  4096u /* a third of what a busy core packs into an EXR */
#define PEN_CACHE_FILES		  64u
#define PEN_CACHE_BYTES		  (1ull << 30)
#define PEN_CACHE_HELD_MAX	  (2u << 20)  /* one that is kept in memory */
#define PEN_CACHE_HELD_BYTES	  (64u << 20) /* and all of them */

/* What the command-line client takes from a server */
#define PEN_ANSWER_BYTES_MAX (16u << 20)
#define PEN_URL_BYTES_MAX    4096u

#endif
