/* SPDX-License-Identifier: Apache-2.0 */
extern "C" {
#include "core/image/oiio_reader.h"
}

#include "core/base/limits.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <exception>
#include <memory>
#include <new>

namespace
{

/* OpenImageIO's own reads before its first byte and beyond the last where a file tells it to. */
class memory_file final : public OIIO::Filesystem::IOMemReader
{
      public:
	using IOMemReader::IOMemReader;

	bool seek(int64_t offset) override
	{
		return offset >= 0 && IOMemReader::seek(offset);
	}

	size_t read(void *to, size_t count) override
	{
		const size_t done = pread(to, count, m_pos);

		m_pos += static_cast<int64_t>(done);
		return done;
	}

	size_t pread(void *to, size_t count, int64_t offset) override
	{
		const auto from = static_cast<size_t>(offset);

		if (offset < 0 || from >= size())
			return 0;
		return IOMemReader::pread(to, std::min(count, size() - from), offset);
	}
};

} // namespace

struct pen_oiio_reader {
	pen_oiio_reader(const void *bytes, size_t size) : file(bytes, size)
	{
	}

	memory_file file;
	std::unique_ptr<OIIO::ImageInput> input; /* uses file: goes before it */
	struct pen_oiio_header header = {};
};

namespace
{

int failed(const struct pen_oiio_reader &reader, struct pen_error *err)
{
	return pen_error_set(err, PEN_EINVALID, "it cannot be decoded: %.200s",
		reader.input->geterror().c_str());
}

/* Runs body, which returns a code, and turns what it throws into one. */
template <typename Body> int guarded(struct pen_error *err, Body body) noexcept
{
	try {
		return body();
	} catch (const std::bad_alloc &) {
		return pen_error_memory(err);
	} catch (const std::exception &e) {
		return pen_error_set(err, PEN_EINVALID, "it cannot be decoded: %.200s", e.what());
	} catch (...) {
		return pen_error_set(err, PEN_EINVALID, "it cannot be decoded");
	}
}

int read_header(struct pen_oiio_reader &reader, const char *format, struct pen_error *err)
{
	OIIO::ImageSpec wanted, spec;

	/* Colours as they are stored, not multiplied by alpha. */
	wanted.attribute("oiio:UnassociatedAlpha", 1);
	if (!reader.input->open(format, spec, wanted))
		return failed(reader, err);
	if (spec.deep || spec.depth != 1 || spec.nchannels < 1 || spec.width < 1 || spec.height < 1)
		return pen_error_set(err, PEN_EUNSUPPORTED, "it is no flat image");
	if (static_cast<unsigned>(spec.nchannels) > PEN_PICTURE_CHANNELS_MAX)
		return pen_error_set(
			err, PEN_ELIMIT, "it has more than %u channels", PEN_PICTURE_CHANNELS_MAX);
	reader.header.width = static_cast<uint32_t>(spec.width);
	reader.header.height = static_cast<uint32_t>(spec.height);
	reader.header.is_linear = spec.format != OIIO::TypeDesc::UINT8;
	reader.header.channels = spec.nchannels >= 3 ? 3 : 1;
	if (spec.alpha_channel == static_cast<int>(reader.header.channels))
		reader.header.channels++;
	return 0;
}

} // namespace

int pen_oiio_reader_create(const char *format, const void *bytes, size_t size,
	struct pen_oiio_reader **ret_reader, struct pen_oiio_header *ret_header,
	struct pen_error *err)
{
	return guarded(err, [&] {
		auto reader = std::make_unique<pen_oiio_reader>(bytes, size);
		int r;

		OIIO::attribute("debug", 0);
		OIIO::attribute("threads", 1);
		OIIO::attribute("exr_threads", -1);
		reader->input = OIIO::ImageInput::create(format);
		if (!reader->input)
			return pen_error_set(err, PEN_EUNSUPPORTED,
				"the image library has no reader for %s", format);
		if (!reader->input->set_ioproxy(&reader->file))
			return failed(*reader, err);
		r = read_header(*reader, format, err);
		if (r < 0)
			return r;
		*ret_header = reader->header;
		*ret_reader = reader.release();
		return 0;
	});
}

int pen_oiio_reader_read(struct pen_oiio_reader *reader, void *ret_pixels, struct pen_error *err)
{
	return guarded(err, [&] {
		const bool floats = reader->header.is_linear;
		const OIIO::TypeDesc type(floats ? OIIO::TypeDesc::FLOAT : OIIO::TypeDesc::UINT8);
		const auto pixel = static_cast<OIIO::stride_t>(4 * type.size());

		if (!reader->input->read_image(0, 0, 0, static_cast<int>(reader->header.channels),
			    type, ret_pixels, pixel))
			return failed(*reader, err);
		return 0;
	});
}

void pen_oiio_reader_destroy(struct pen_oiio_reader *reader)
{
	(void)guarded(nullptr, [&] {
		delete reader;
		return 0;
	});
}
