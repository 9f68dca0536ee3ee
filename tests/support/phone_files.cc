#include "tests/support/phone_files.h"

#include <OpenImageIO/imageio.h>

#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "scene/files/temporary_folder.h"
#include "scene/program/subprocess.h"

namespace lumi::test {
namespace {

namespace fs = std::filesystem;

// ISO/IEC 14496-12: a size, a name of four letters, a body. ISO/IEC 23008-12 has the boxes of a HEIC file.
struct Box {
  std::string type, body;
};

std::uint64_t Number(std::string_view bytes) {
  std::uint64_t value = 0;
  for (const char c : bytes) value = value << 8 | static_cast<unsigned char>(c);
  return value;
}
std::string AsBytes(std::uint64_t value, std::size_t count) {
  std::string bytes(count, '\0');
  for (std::size_t i = count; i-- > 0; value >>= 8) bytes[i] = static_cast<char>(value & 255);
  return bytes;
}

std::vector<Box> Boxes(std::string_view bytes) {
  std::vector<Box> boxes;
  while (bytes.size() >= 8) {
    const std::uint64_t size = Number(bytes.substr(0, 4));
    if (size < 8 || size > bytes.size()) throw std::runtime_error("a box of a size that this reader does not know");
    boxes.push_back({std::string(bytes.substr(4, 4)), std::string(bytes.substr(8, size - 8))});
    bytes.remove_prefix(size);
  }
  return boxes;
}
std::string Joined(const std::vector<Box>& boxes) {
  std::string bytes;
  for (const Box& box : boxes) bytes += AsBytes(box.body.size() + 8, 4) + box.type + box.body;
  return bytes;
}
Box& Named(std::vector<Box>& boxes, std::string_view type) {
  for (Box& box : boxes)
    if (box.type == type) return box;
  throw std::runtime_error("no box " + std::string(type));
}

// The item's list of properties gets one more. Returns by how many bytes it grew.
std::size_t Associate(std::string& ipma, std::uint64_t item, std::uint64_t property) {
  const std::size_t id_bytes = ipma[0] < 1 ? 2 : 4, index_bytes = (ipma[3] & 1) != 0 ? 2 : 1;
  std::size_t at = 8;
  for (std::uint64_t entries = Number({ipma.data() + 4, 4}); entries > 0; --entries) {
    const bool here = Number({ipma.data() + at, id_bytes}) == item;
    at += id_bytes;
    const auto count = static_cast<std::size_t>(static_cast<unsigned char>(ipma[at]));
    if (here) {
      ipma[at] = static_cast<char>(count + 1);
      const std::uint64_t essential = std::uint64_t{1} << (8 * index_bytes - 1);
      ipma.insert(at + 1 + count * index_bytes, AsBytes(essential | property, index_bytes));
      return index_bytes;
    }
    at += 1 + count * index_bytes;
  }
  throw std::runtime_error("the photo has no properties");
}

// What lies behind the boxes that grew has moved.
void MoveExtents(std::string& iloc, std::uint64_t by) {
  const int version = iloc[0];
  const auto half = [&](std::size_t at, int shift) { return static_cast<std::size_t>(iloc[at] >> shift & 15); };
  const std::size_t offset_bytes = half(4, 4), length_bytes = half(4, 0), base_bytes = half(5, 4),
                    index_bytes = version > 0 ? half(5, 0) : 0, id_bytes = version < 2 ? 2 : 4;
  std::size_t at = 6;
  const auto take = [&](std::size_t bytes) {
    at += bytes;
    return Number({iloc.data() + at - bytes, bytes});
  };
  const auto move = [&](std::size_t bytes) {
    iloc.replace(at, bytes, AsBytes(Number({iloc.data() + at, bytes}) + by, bytes));
  };
  for (std::uint64_t items = take(id_bytes); items > 0; --items) {
    take(id_bytes);
    const bool in_file = version == 0 || (take(2) & 15) == 0;
    take(2);
    if (in_file && base_bytes > 0) move(base_bytes);
    take(base_bytes);
    for (std::uint64_t extents = take(2); extents > 0; --extents) {
      take(index_bytes);
      if (in_file && base_bytes == 0) move(offset_bytes);
      take(offset_bytes + length_bytes);
    }
  }
}

// quarters: of a turn, against the clock.
std::string WithRotation(const std::string& heic, int quarters) {
  std::vector<Box> file = Boxes(heic);
  Box& meta = Named(file, "meta");
  const std::string flags = meta.body.substr(0, 4);
  std::vector<Box> in_meta = Boxes(std::string_view(meta.body).substr(4));
  Box& iprp = Named(in_meta, "iprp");
  std::vector<Box> in_iprp = Boxes(iprp.body);
  Box& ipco = Named(in_iprp, "ipco");
  std::vector<Box> properties = Boxes(ipco.body);
  properties.push_back({"irot", std::string(1, static_cast<char>(quarters))});
  const std::string joined = Joined(properties);
  std::size_t grown = joined.size() - ipco.body.size();
  ipco.body = joined;
  grown += Associate(Named(in_iprp, "ipma").body, Number(std::string_view(Named(in_meta, "pitm").body).substr(4, 2)),
                     properties.size());
  iprp.body = Joined(in_iprp);
  MoveExtents(Named(in_meta, "iloc").body, grown);
  meta.body = flags + Joined(in_meta);
  return Joined(file);
}

bool Runs(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"ffmpeg", "-v", "error", "-y"});
  return RunSubprocess(arguments).exit_code == 0;
}

}  // namespace

void WriteHeic(const fs::path& path, const Image8& stored, int orientation, int focal_35mm) {
  OIIO::ImageSpec spec(stored.width, stored.height, stored.channels, OIIO::TypeDesc::UINT8);
  spec.attribute("Compression", "heic:95");
  spec.attribute("Make", "Acme");
  spec.attribute("Model", "Phone 7");
  spec.attribute("Exif:FocalLengthIn35mmFilm", focal_35mm);
  fs::create_directories(path.parent_path());
  const auto out = OIIO::ImageOutput::create(path.string());
  if (!out || !out->open(path.string(), spec) || !out->write_image(OIIO::TypeDesc::UINT8, stored.data.data()) ||
      !out->close())
    throw std::runtime_error(path.string() + ": " + (out ? out->geterror() : OIIO::geterror()));
  const int quarters = orientation == 3 ? 2 : orientation == 6 ? 3 : orientation == 8 ? 1 : 0;
  if (quarters == 0) return;
  std::stringstream bytes;
  bytes << std::ifstream(path, std::ios::binary).rdbuf();
  std::ofstream(path, std::ios::binary) << WithRotation(bytes.str(), quarters);
}

bool CanWriteHeic() {
  const TemporaryFolder folder;
  try {
    WriteHeic(folder / "a.heic", Image8(64, 64, 3, 128), 1, 28);
  } catch (const std::runtime_error&) {
    return false;
  }
  return true;
}

bool CanWriteHevc() {
  const TemporaryFolder folder;
  return Runs({"-f", "lavfi", "-i", "color=s=64x64:d=0.1", "-c:v", "libx265", folder / "a.mp4"});
}

void WritePhoneFilm(const fs::path& film, const std::string& frames, const fs::path& out) {
  const TemporaryFolder folder;
  const std::string lying = folder / "lying.mp4";
  if (!Runs({"-i",
             film,
             "-vf",
             "select='" + frames + "',transpose=2,scale=out_color_matrix=bt709:out_range=tv",
             "-vsync",
             "vfr",
             "-c:v",
             "libx265",
             "-x265-params",
             "log-level=none",
             "-crf",
             "12",
             "-tag:v",
             "hvc1",
             "-pix_fmt",
             "yuv420p",
             "-colorspace",
             "bt709",
             "-color_primaries",
             "bt709",
             "-color_trc",
             "bt709",
             lying}))
    throw std::runtime_error("ffmpeg cannot encode " + film.string());
  // Since FFmpeg 6 by an option of the input (against the clock), before by a tag (with it).
  if (!Runs({"-display_rotation", "-90", "-i", lying, "-c", "copy", out}) &&
      !Runs({"-i", lying, "-c", "copy", "-metadata:s:v:0", "rotate=90", out}))
    throw std::runtime_error("ffmpeg cannot turn " + lying);
}

}  // namespace lumi::test
