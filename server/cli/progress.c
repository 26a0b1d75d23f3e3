/* SPDX-License-Identifier: Apache-2.0 */
#include "server/cli/progress.h"

#include "core/base/clock.h"

#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

enum { BAR_INTERVAL_MS = 100, LINE_INTERVAL_MS = 3000, BAR_COLUMNS_MAX = 50, TEXT_MAX = 128 };

void pen_progress_init(struct pen_progress *progress, bool quiet)
{
	*progress = (struct pen_progress){
		.style = quiet			 ? PEN_PROGRESS_NONE
			 : isatty(STDERR_FILENO) ? PEN_PROGRESS_BAR
						 : PEN_PROGRESS_LINES,
		.shown_ms = pen_clock_ms(),
	};
}

static int terminal_columns(void)
{
	struct winsize size = {0};

	return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

/* "1.25 M samples/s, 0:42 left", as far as it is known. */
static void rate_format(const struct pen_resource *resource, char *ret_text, size_t size)
{
	size_t used = 0;

	ret_text[0] = '\0';
	if (strcmp(resource->state, "running") != 0) {
		(void)snprintf(ret_text, size, "%s", resource->state);
		return;
	}
	if (resource->seconds > 0) {
		double rate = (double)resource->samples_done / resource->seconds;

		used = (size_t)snprintf(ret_text, size, "%.2f M samples/s", rate * 1e-6);
	}
	if (resource->eta_seconds >= 0 && resource->eta_seconds < 1e7 && used < size) {
		int left = (int)(resource->eta_seconds + 0.5);

		(void)snprintf(ret_text + used, size - used, "%s%d:%02d left", used ? ", " : "",
			left / 60, left % 60);
	}
}

static void bar_draw(double share, const char *text)
{
	int columns = terminal_columns() - (int)strlen(text) - 10;
	char bar[BAR_COLUMNS_MAX + 1];
	int filled;

	if (columns > BAR_COLUMNS_MAX)
		columns = BAR_COLUMNS_MAX;
	if (columns < 0)
		columns = 0;
	filled = (int)(share * columns);
	memset(bar, '#', (size_t)filled);
	memset(bar + filled, '.', (size_t)(columns - filled));
	bar[columns] = '\0';
	(void)fprintf(stderr, "\r[%s] %3d%%  %s\033[K", bar, (int)(share * 100), text);
	(void)fflush(stderr);
}

/* Whether something is to be shown now. */
static bool is_due(struct pen_progress *progress)
{
	const int64_t interval_ms =
		progress->style == PEN_PROGRESS_BAR ? BAR_INTERVAL_MS : LINE_INTERVAL_MS;
	const int64_t now_ms = pen_clock_ms();

	if (progress->style == PEN_PROGRESS_NONE || now_ms - progress->shown_ms < interval_ms)
		return false;
	progress->shown_ms = now_ms;
	return true;
}

static void show(struct pen_progress *progress, double share, const char *text)
{
	progress->drawn = progress->style == PEN_PROGRESS_BAR;
	if (!(share > 0))
		share = 0;
	if (share > 1)
		share = 1;
	if (progress->drawn)
		bar_draw(share, text);
	else
		(void)fprintf(stderr, "%d%%  %s\n", (int)(share * 100), text);
}

void pen_progress_update(struct pen_progress *progress, const struct pen_resource *resource)
{
	char text[TEXT_MAX];

	if (!is_due(progress))
		return;
	rate_format(resource, text, sizeof text);
	show(progress, resource->progress, text);
}

void pen_progress_transfer(struct pen_progress *progress, const char *name, double share)
{
	char text[TEXT_MAX];

	if (!is_due(progress))
		return;
	/* A name is somebody's: it must not drive the terminal. */
	(void)snprintf(text, sizeof text, "uploading %.60s", name);
	for (char *c = text; *c; c++)
		if ((unsigned char)*c < ' ' || *c == 0x7F)
			*c = '?';
	show(progress, share, text);
}

void pen_progress_finish(struct pen_progress *progress)
{
	if (progress->drawn)
		(void)fputs("\r\033[K", stderr);
	progress->drawn = false;
}
