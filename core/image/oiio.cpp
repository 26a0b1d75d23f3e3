/* SPDX-License-Identifier: Apache-2.0 */
extern "C" {
#include "core/image/oiio.h"
}

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cerrno>
#include <exception>
#include <memory>
#include <new>
#include <string_view>
#include <unistd.h>

namespace
{

/* Sends what a writer writes to a descriptor, so that no image is ever held whole in memory. */
class DescriptorOutput : public OIIO::Filesystem::IOProxy
{
      public:
	explicit DescriptorOutput(int fd) : IOProxy("", Write), fd_(fd)
	{
	}

	const char *proxytype() const override
	{
		return "descriptor";
	}

	size_t write(const void *buf, size_t size) override
	{
		size_t done = pwrite(buf, size, m_pos);

		m_pos += static_cast<int64_t>(done);
		return done;
	}

	size_t pwrite(const void *buf, size_t size, int64_t offset) override
	{
		const char *bytes = static_cast<const char *>(buf);
		size_t done = 0;

		while (done < size) {
			ssize_t n = ::pwrite(fd_, bytes + done, size - done,
				offset + static_cast<int64_t>(done));

			if (n < 0 && errno == EINTR)
				continue;
			if (n <= 0) {
				failure = n < 0 ? errno : EIO;
				break;
			}
			done += static_cast<size_t>(n);
		}
		end_ = std::max(end_, offset + static_cast<int64_t>(done));
		return done;
	}

	size_t size() const override
	{
		return static_cast<size_t>(end_);
	}

	int failure = 0; /* errno of the write that failed */

      private:
	int fd_;
	int64_t end_ = 0;
};

OIIO::ImageSpec image_spec(const struct pen_oiio_layout &layout)
{
	OIIO::ImageSpec spec(static_cast<int>(pen_rect_width(layout.window)),
		static_cast<int>(pen_rect_height(layout.window)), static_cast<int>(layout.channels),
		layout.linear ? OIIO::TypeDesc::FLOAT : OIIO::TypeDesc::UINT8);

	spec.x = static_cast<int>(layout.window.x0);
	spec.y = static_cast<int>(layout.window.y0);
	spec.full_width = static_cast<int>(layout.width);
	spec.full_height = static_cast<int>(layout.height);
	spec.channelnames.assign(layout.names, layout.names + layout.channels);
	spec.attribute("oiio:ColorSpace", layout.linear ? "Linear" : "sRGB");
	/* A writer passes over the settings of others, but PNG's keeps all text. */
	spec.attribute("png:compressionLevel", layout.final ? 6 : 1);
	if (layout.linear)
		spec.attribute("compression", "zip");
	else
		spec.attribute("Compression", layout.final ? "jpeg:95" : "jpeg:90");
	if (std::string_view(layout.format) == "jpeg")
		spec.attribute("jpeg:subsampling", "4:4:4");
	for (unsigned i = 0; i < layout.attribute_count; i++)
		spec.attribute(layout.attributes[i].name, layout.attributes[i].text);
	/* The EXR writer adds the time of day unless this is set, and drops what is no string. */
	spec.attribute("DateTime", 0);
	return spec;
}

} // namespace

struct pen_oiio_output {
	explicit pen_oiio_output(int fd) : file(fd)
	{
	}

	DescriptorOutput file;
	std::unique_ptr<OIIO::ImageOutput> writer; /* uses file: goes before it */
	OIIO::TypeDesc type;
};

static int output_failed(const struct pen_oiio_output &output, struct pen_error *err)
{
	if (output.file.failure != 0)
		return pen_error_system(err, output.file.failure, "writing the image");
	return pen_error_set(
		err, PEN_EIO, "writing the image: %s", output.writer->geterror().c_str());
}

/* Runs body, which returns a code, and turns what it throws into one. */
template <typename Body> static int guarded(struct pen_error *err, Body body) noexcept
{
	try {
		return body();
	} catch (const std::bad_alloc &) {
		return pen_error_memory(err);
	} catch (const std::exception &e) {
		return pen_error_set(err, PEN_EIO, "writing the image: %s", e.what());
	} catch (...) {
		return pen_error_set(err, PEN_EIO, "writing the image: the image library failed");
	}
}

int pen_oiio_create(const struct pen_oiio_layout *layout, int fd,
	struct pen_oiio_output **ret_output, struct pen_error *err)
{
	return guarded(err, [&] {
		auto output = std::make_unique<pen_oiio_output>(fd);

		OIIO::attribute("debug", 0);
		OIIO::attribute("threads", 1);
		OIIO::attribute("exr_threads", -1);
		output->writer = OIIO::ImageOutput::create(layout->format);
		if (!output->writer)
			return pen_error_set(err, PEN_EUNSUPPORTED,
				"the image library has no writer for %s", layout->format);
		output->type = layout->linear ? OIIO::TypeDesc::FLOAT : OIIO::TypeDesc::UINT8;
		if (!output->writer->set_ioproxy(&output->file) ||
			!output->writer->open(layout->format, image_spec(*layout)))
			return output_failed(*output, err);
		*ret_output = output.release();
		return 0;
	});
}

int pen_oiio_write(
	struct pen_oiio_output *output, uint32_t y, const void *pixels, struct pen_error *err)
{
	return guarded(err, [&] {
		if (!output->writer->write_scanline(static_cast<int>(y), 0, output->type, pixels))
			return output_failed(*output, err);
		return 0;
	});
}

int pen_oiio_complete(struct pen_oiio_output *output, uint64_t *ret_size, struct pen_error *err)
{
	return guarded(err, [&] {
		/* Not every writer looks at what its writes return: a failure is remembered here.
		 */
		if (!output->writer->close() || output->file.failure != 0)
			return output_failed(*output, err);
		*ret_size = output->file.size();
		return 0;
	});
}

void pen_oiio_destroy(struct pen_oiio_output *output)
{
	(void)guarded(nullptr, [&] {
		delete output;
		return 0;
	});
}
