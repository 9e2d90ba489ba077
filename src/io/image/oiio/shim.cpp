// The OpenImageIO module: a C ABI of three functions over OpenImageIO, from memory to memory.
//
// It never sees a file name or a colour space: files are opened, written and renamed by the caller,
// and samples arrive as they are to be stored. No exception and no C++ type crosses the border.
// src/io/image/oiio/mod.rs declares the same types; INTERFACE changes with them.

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

#define EXPORT extern "C" __attribute__((visibility("default")))

namespace {

constexpr uint32_t INTERFACE = 3;

enum Sample : int32_t { U8 = 0, HALF = 1, FLOAT = 2 };
enum Kind : int32_t { TEXT = 0, INT = 1, FLOATS = 2 };

// RGB, row by row from the top, no padding; at (x, y) of a frame.
struct Picture {
    int32_t width, height, x, y, frame_width, frame_height, sample;
    const void* samples;
    size_t size;
};

struct Attribute {
    const char* name;
    const void* data; // NUL-terminated text, one int32_t, or `count` floats
    int32_t kind, count;
};

// What a file holds; `channels` is 1 (grey) or 3 (RGB), others are left out.
struct Header {
    int32_t width, height, channels, bits;
};

using Sink   = int32_t (*)(void* context, const uint8_t* data, size_t size);
using Buffer = void* (*)(void* context, const Header* header);

// Runs `body`; 0 if it returned, else 1 with the reason, cut to fit, in `message`.
template<class Body> int32_t guarded(char* message, size_t capacity, Body&& body) noexcept
{
    auto say = [&](const char* why) {
        if (!message || capacity == 0)
            return;
        size_t length = std::min(std::strlen(why), capacity - 1);
        std::memcpy(message, why, length);
        message[length] = 0;
    };
    try {
        body();
        return 0;
    } catch (const std::exception& e) {
        say(e.what());
    } catch (...) {
        say("unknown exception");
    }
    return 1;
}

// One thread for what is read or written while it lives: the caller has its own, and a pool would stay. The attribute for
// EXR is the process's, so it is put back, for the host may use OpenImageIO, too.
class OneThread {
    static std::mutex& mutex()
    {
        static std::mutex one_at_a_time;
        return one_at_a_time;
    }
    std::unique_lock<std::mutex> lock;
    int before = 0;

public:
    explicit OneThread(const char* format)
    {
        if (std::strcmp(format, "openexr") != 0)
            return;
        lock = std::unique_lock(mutex());
        OIIO::getattribute("exr_threads", before);
        OIIO::attribute("exr_threads", 1);
    }
    ~OneThread()
    {
        if (lock)
            OIIO::attribute("exr_threads", before);
    }
    OneThread(const OneThread&) = delete;
    OneThread& operator=(const OneThread&) = delete;
};

[[noreturn]] void fail(std::string why)
{
    throw std::runtime_error(why.empty() ? "OpenImageIO gives no reason" : why);
}

size_t checked_product(size_t a, size_t b)
{
    if (b != 0 && a > std::numeric_limits<size_t>::max() / b)
        fail("size overflow");
    return a * b;
}

OIIO::TypeDesc type_of(int32_t sample)
{
    switch (sample) {
    case U8: return OIIO::TypeDesc::UINT8;
    case HALF: return OIIO::TypeDesc::HALF;
    case FLOAT: return OIIO::TypeDesc::FLOAT;
    }
    fail("unknown sample type");
}

void set(OIIO::ImageSpec& spec, const Attribute& a)
{
    if (!a.name || !a.data)
        fail("attribute without name or value");
    switch (a.kind) {
    case TEXT: spec.attribute(a.name, static_cast<const char*>(a.data)); return;
    case INT: spec.attribute(a.name, *static_cast<const int32_t*>(a.data)); return;
    case FLOATS:
        if (a.count < 1)
            fail("attribute without values");
        // One value is a scalar, not an array of one.
        spec.attribute(a.name, OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, OIIO::TypeDesc::SCALAR, a.count == 1 ? 0 : a.count),
                       a.data);
        return;
    }
    fail("unknown kind of attribute");
}

} // namespace

// The version of this interface; `version` becomes the text of OpenImageIO's, which lives for ever.
EXPORT uint32_t caustica_oiio_interface(const char** version) noexcept
{
    if (version)
        *version = OIIO_VERSION_STRING;
    return INTERFACE;
}

// Encodes `picture` as `format` (OpenImageIO's name) and hands the whole file to `sink` at once, which
// returns 0 if it took it.
EXPORT int32_t caustica_oiio_encode(const char* format, const Picture* picture, const Attribute* attributes,
                                    size_t attribute_count, Sink sink, void* context, char* message,
                                    size_t capacity) noexcept
{
    return guarded(message, capacity, [&] {
        if (!format || !picture || !picture->samples || (!attributes && attribute_count) || !sink)
            fail("null argument");
        if (picture->width < 1 || picture->height < 1)
            fail("empty picture");
        OIIO::TypeDesc type = type_of(picture->sample);
        size_t pixels       = checked_product(size_t(picture->width), size_t(picture->height));
        if (checked_product(pixels, 3 * type.size()) != picture->size)
            fail("samples do not fit the size of the picture");

        // Outlives the writer, which may still write in its destructor.
        OneThread one(format);
        std::vector<unsigned char> bytes;
        OIIO::Filesystem::IOVecOutput memory(bytes);
        auto out = OIIO::ImageOutput::create(format, &memory);
        if (!out)
            fail(OIIO::geterror());
        if (!out->supports("ioproxy"))
            fail(std::string(format) + ": this OpenImageIO cannot write it to memory");
        out->threads(1);
        OIIO::ImageSpec spec(picture->width, picture->height, 3, type);
        spec.x           = picture->x;
        spec.y           = picture->y;
        spec.full_width  = picture->frame_width;
        spec.full_height = picture->frame_height;
        for (size_t i = 0; i < attribute_count; ++i)
            set(spec, attributes[i]);
        if (!out->open(std::string("memory.") + format, spec) || !out->write_image(type, picture->samples) || !out->close())
            fail(out->geterror());
        out.reset();
        if (sink(context, bytes.data(), bytes.size()) != 0)
            fail("out of memory");
    });
}

// Decodes a file of `format` (OpenImageIO's name) that lies in memory. `buffer` is told the header and
// returns room for width * height * channels samples, bytes if they have 8 bits, else floats, or null to stop.
EXPORT int32_t caustica_oiio_decode(const char* format, const uint8_t* data, size_t size, Buffer buffer, void* context,
                                    char* message, size_t capacity) noexcept
{
    return guarded(message, capacity, [&] {
        if (!format || !data || !buffer)
            fail("null argument");
        OneThread one(format);
        OIIO::Filesystem::IOMemReader memory(data, size);
        OIIO::ImageSpec config;
        // Colour as stored: alpha is left out, so it must not be multiplied in.
        config.attribute("oiio:UnassociatedAlpha", 1);
        auto in = OIIO::ImageInput::create(format);
        if (!in)
            fail(OIIO::geterror());
        if (!in->supports("ioproxy") || !in->set_ioproxy(&memory))
            fail(std::string(format) + ": this OpenImageIO cannot read it from memory");
        in->threads(1);
        OIIO::ImageSpec spec;
        if (!in->open(std::string("memory.") + format, spec, config))
            fail(in->geterror());
        auto base = OIIO::TypeDesc::BASETYPE(spec.format.basetype);
        bool real = base == OIIO::TypeDesc::HALF || base == OIIO::TypeDesc::FLOAT || base == OIIO::TypeDesc::DOUBLE;
        int32_t bits = real ? 0 : int32_t(8 * spec.format.basesize());
        Header header { spec.width, spec.height, spec.nchannels < 3 ? 1 : 3, bits };
        if (header.width < 1 || header.height < 1 || spec.depth > 1 || spec.nchannels < 1)
            fail("not a flat picture");
        void* room = buffer(context, &header);
        if (!room)
            fail("stopped by the caller");
        auto type = bits == 8 ? OIIO::TypeDesc::UINT8 : OIIO::TypeDesc::FLOAT;
        if (!in->read_image(0, 0, 0, header.channels, type, room) || in->has_error())
            fail(in->geterror());
        in->close();
    });
}
