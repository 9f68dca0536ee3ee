#include "reconstruct/colmap_database.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <cmath>
#include <cstring>

#include "scene/files/open_to_read.h"
#include "scene/program/error.h"
#include "scene/program/out_of_memory.h"

namespace lumi {
namespace {

// COLMAP's key of a pair: id1 * kMaxImages + id2, id1 < id2.
constexpr std::int64_t kMaxImages = 2147483647;

// As matches are written: the two positions of each, one after another.
std::vector<std::uint32_t> AsNumbers(const std::vector<std::pair<int, int>>& matches) {
  std::vector<std::uint32_t> numbers;
  numbers.reserve(2 * matches.size());
  for (const auto& [i, j] : matches) {
    numbers.push_back(static_cast<std::uint32_t>(i));
    numbers.push_back(static_cast<std::uint32_t>(j));
  }
  return numbers;
}

std::int64_t PairId(std::int64_t a, std::int64_t b) { return a < b ? a * kMaxImages + b : b * kMaxImages + a; }

}  // namespace

struct ColmapDatabase::Impl {
  std::filesystem::path path;
  bool ours = true;
  sqlite3* db = nullptr;
  ~Impl() { sqlite3_close(db); }

  [[noreturn]] void Fail() const {
    const int code = sqlite3_errcode(db) & 0xff;
    const bool io = code == SQLITE_IOERR && sqlite3_extended_errcode(db) != SQLITE_IOERR_SHORT_READ;
    // SQLite opens a file that it may not write for reading, and says so at the first write.
    const bool closed = ours && (code == SQLITE_CANTOPEN || code == SQLITE_READONLY);
    if (io || closed || code == SQLITE_FULL || code == SQLITE_NOMEM)
      throw MachineError(fmt::format("cannot be read or written: {}", sqlite3_errmsg(db)), "is the disk full?", path);
    ThrowIfMachineIsShort(path, sqlite3_system_errno(db));
    throw InputError(path, fmt::format("not a readable COLMAP database: {}", sqlite3_errmsg(db)));
  }

  struct Statement {
    sqlite3_stmt* s = nullptr;
    ~Statement() { sqlite3_finalize(s); }
  };
  void Prepare(Statement& statement, const char* sql) const {
    if (sqlite3_prepare_v2(db, sql, -1, &statement.s, nullptr) != SQLITE_OK) Fail();
  }
  bool Step(Statement& statement) const {
    const int rc = sqlite3_step(statement.s);
    if (rc != SQLITE_ROW && rc != SQLITE_DONE) Fail();
    return rc == SQLITE_ROW;
  }
  void Execute(const char* sql) const {
    if (sqlite3_exec(db, sql, nullptr, nullptr, nullptr) != SQLITE_OK) Fail();
  }
  // All that `body` writes, or nothing.
  template <typename Body>
  void Transact(const Body& body) const {
    Execute("BEGIN IMMEDIATE");
    try {
      body();
      ThrowIfMemoryRanOut();
      Execute("COMMIT");
    } catch (...) {
      sqlite3_exec(db, "ROLLBACK", nullptr, nullptr, nullptr);
      throw;
    }
  }
  static void Bind(Statement& statement, int at, const void* data, std::size_t bytes) {
    // Nothing is an empty blob, as with COLMAP, and not NULL.
    if (bytes == 0)
      sqlite3_bind_zeroblob(statement.s, at, 0);
    else
      sqlite3_bind_blob64(statement.s, at, data, bytes, SQLITE_STATIC);
  }
  // The next row of an INSERT.
  void Write(Statement& statement) const {
    Step(statement);
    sqlite3_reset(statement.s);
    sqlite3_clear_bindings(statement.s);
  }
  std::int64_t AddCamera(const Camera& camera, bool focal_is_known) const {
    Statement insert;
    Prepare(insert, "INSERT INTO cameras(model, width, height, params, prior_focal_length) VALUES(?, ?, ?, ?, ?)");
    sqlite3_bind_int(insert.s, 1, static_cast<int>(camera.model));
    sqlite3_bind_int(insert.s, 2, camera.width_px);
    sqlite3_bind_int(insert.s, 3, camera.height_px);
    Bind(insert, 4, camera.params.data(), camera.params.size() * sizeof(double));
    sqlite3_bind_int(insert.s, 5, focal_is_known ? 1 : 0);
    Write(insert);
    return sqlite3_last_insert_rowid(db);
  }
  std::vector<DatabasePair> Pairs(const char* sql) const {
    Statement statement;
    Prepare(statement, sql);
    std::vector<DatabasePair> pairs;
    while (Step(statement)) {
      const std::int64_t id = sqlite3_column_int64(statement.s, 0);
      pairs.push_back({id / kMaxImages, id % kMaxImages, sqlite3_column_int(statement.s, 1)});
    }
    return pairs;
  }
  std::vector<std::pair<int, int>> MatchesIn(const char* table, std::int64_t image1, std::int64_t image2) const;
};

ColmapDatabase::ColmapDatabase(const std::filesystem::path& path, Access access) : impl_(std::make_unique<Impl>()) {
  impl_->path = path;
  impl_->ours = access == Access::kOurs;
  int rc = SQLITE_OK;
  if (access == Access::kOurs) {
    rc = sqlite3_open_v2(path.c_str(), &impl_->db, SQLITE_OPEN_READWRITE, nullptr);
  } else {
    std::string uri = "file:";
    for (const char c : std::filesystem::absolute(path).string())
      uri += (c == '?' || c == '#' || c == '%') ? fmt::format("%{:02x}", static_cast<int>(c)) : std::string(1, c);
    rc = sqlite3_open_v2((uri + "?immutable=1").c_str(), &impl_->db, SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, nullptr);
  }
  if (rc != SQLITE_OK) impl_->Fail();
  sqlite3_busy_timeout(impl_->db, 5000);
  for (const char* table : {"cameras", "images", "keypoints", "matches", "two_view_geometries"}) {
    Impl::Statement statement;
    impl_->Prepare(statement, "SELECT COUNT(*) FROM sqlite_master WHERE type = 'table' AND name = ?");
    sqlite3_bind_text(statement.s, 1, table, -1, SQLITE_STATIC);
    if (!impl_->Step(statement) || sqlite3_column_int(statement.s, 0) == 0)
      throw InputError(path, fmt::format("not a COLMAP database: it has no table '{}'", table));
  }
}
ColmapDatabase::~ColmapDatabase() = default;
ColmapDatabase::ColmapDatabase(ColmapDatabase&&) noexcept = default;

bool ColmapDatabase::IsWhole() const {
  try {
    Impl::Statement statement;
    impl_->Prepare(statement, "PRAGMA quick_check(1)");
    return impl_->Step(statement) &&
           std::strcmp(reinterpret_cast<const char*>(sqlite3_column_text(statement.s, 0)), "ok") == 0;
  } catch (const InputError&) {
    return false;
  }
}

bool ColmapDatabase::IsDatabase(const std::filesystem::path& path, Access access) {
  std::error_code ec;
  if (!std::filesystem::is_regular_file(path, ec)) return false;
  try {
    const ColmapDatabase probe(path, access);
    return true;
  } catch (const InputError&) {
    return false;
  }
}

std::vector<DatabaseImage> ColmapDatabase::Images() const {
  Impl::Statement statement;
  impl_->Prepare(statement,
                 "SELECT images.image_id, images.camera_id, images.name, COALESCE(keypoints.rows, -1) FROM images "
                 "LEFT JOIN keypoints ON keypoints.image_id = images.image_id ORDER BY images.name");
  std::vector<DatabaseImage> images;
  while (impl_->Step(statement)) {
    const auto* name = reinterpret_cast<const char*>(sqlite3_column_text(statement.s, 2));
    images.push_back({sqlite3_column_int64(statement.s, 0), sqlite3_column_int64(statement.s, 1), name ? name : "",
                      std::max(0, sqlite3_column_int(statement.s, 3))});
  }
  return images;
}

std::vector<DatabasePair> ColmapDatabase::MatchedPairs() const {
  return impl_->Pairs("SELECT pair_id, rows FROM matches ORDER BY pair_id");
}
std::vector<DatabasePair> ColmapDatabase::VerifiedPairs() const {
  return impl_->Pairs("SELECT pair_id, rows FROM two_view_geometries WHERE rows > 0 ORDER BY pair_id");
}

std::vector<Eigen::Vector2d> ColmapDatabase::Keypoints(std::int64_t image_id) const {
  Impl::Statement statement;
  impl_->Prepare(statement, "SELECT rows, cols, data FROM keypoints WHERE image_id = ?");
  sqlite3_bind_int64(statement.s, 1, image_id);
  std::vector<Eigen::Vector2d> keypoints;
  if (!impl_->Step(statement)) return keypoints;
  const std::int64_t rows = sqlite3_column_int64(statement.s, 0), cols = sqlite3_column_int64(statement.s, 1);
  const auto bytes = static_cast<std::int64_t>(sqlite3_column_bytes(statement.s, 2));
  if (rows < 0 || cols < 2 || cols > 64 || rows > bytes ||
      rows * cols * static_cast<std::int64_t>(sizeof(float)) != bytes)
    throw InputError(impl_->path, fmt::format("keypoints of image {}: {} x {} numbers announced, {} bytes there",
                                              image_id, rows, cols, bytes));
  const auto* data = static_cast<const char*>(sqlite3_column_blob(statement.s, 2));
  keypoints.reserve(static_cast<std::size_t>(rows));
  for (std::int64_t i = 0; i < rows; ++i) {
    float xy[2];
    std::memcpy(xy, data + i * cols * static_cast<std::int64_t>(sizeof(float)), sizeof(xy));
    keypoints.emplace_back(xy[0], xy[1]);
  }
  return keypoints;
}

ByteDescriptors ColmapDatabase::Descriptors(std::int64_t image_id) const {
  constexpr std::int64_t kLength = kByteDescriptorLength;
  Impl::Statement statement;
  impl_->Prepare(statement, "SELECT rows, cols, data FROM descriptors WHERE image_id = ?");
  sqlite3_bind_int64(statement.s, 1, image_id);
  ByteDescriptors descriptors(0, kLength);
  if (!impl_->Step(statement)) return descriptors;
  const std::int64_t rows = sqlite3_column_int64(statement.s, 0), cols = sqlite3_column_int64(statement.s, 1);
  const auto bytes = static_cast<std::int64_t>(sqlite3_column_bytes(statement.s, 2));
  if (rows < 0 || cols != kLength || rows > bytes || rows * cols != bytes)
    throw InputError(impl_->path, fmt::format("descriptors of image {}: {} x {} announced, {} bytes there", image_id,
                                              rows, cols, bytes));
  descriptors.resize(rows, cols);
  if (rows > 0) std::memcpy(descriptors.data(), sqlite3_column_blob(statement.s, 2), static_cast<std::size_t>(bytes));
  return descriptors;
}

std::vector<std::pair<int, int>> ColmapDatabase::Impl::MatchesIn(const char* table, std::int64_t image1,
                                                                 std::int64_t image2) const {
  Statement statement;
  Prepare(statement, fmt::format("SELECT rows, data FROM {} WHERE pair_id = ?", table).c_str());
  sqlite3_bind_int64(statement.s, 1, PairId(image1, image2));
  std::vector<std::pair<int, int>> matches;
  if (!Step(statement)) return matches;
  const std::int64_t rows = sqlite3_column_int64(statement.s, 0);
  const auto bytes = static_cast<std::int64_t>(sqlite3_column_bytes(statement.s, 1));
  if (rows < 0 || rows > bytes || rows * 8 != bytes)
    throw InputError(
        path, fmt::format("matches of images {} and {}: {} announced, {} bytes there", image1, image2, rows, bytes));
  const auto* data = static_cast<const char*>(sqlite3_column_blob(statement.s, 1));
  for (std::int64_t i = 0; i < rows; ++i) {
    std::uint32_t ij[2];
    std::memcpy(ij, data + i * 8, sizeof(ij));
    if (image1 > image2) std::swap(ij[0], ij[1]);
    matches.emplace_back(static_cast<int>(ij[0]), static_cast<int>(ij[1]));
  }
  return matches;
}

std::vector<std::pair<int, int>> ColmapDatabase::Matches(std::int64_t image1, std::int64_t image2) const {
  return impl_->MatchesIn("matches", image1, image2);
}
std::vector<std::pair<int, int>> ColmapDatabase::VerifiedMatches(std::int64_t image1, std::int64_t image2) const {
  return impl_->MatchesIn("two_view_geometries", image1, image2);
}

std::vector<DatabaseCamera> ColmapDatabase::Cameras() const {
  Impl::Statement statement;
  impl_->Prepare(statement, "SELECT camera_id, model, width, height, params, prior_focal_length FROM cameras");
  std::vector<DatabaseCamera> cameras;
  while (impl_->Step(statement)) {
    const auto model = CameraModelFromId(sqlite3_column_int(statement.s, 1));
    if (!model) continue;
    DatabaseCamera entry;
    entry.id = sqlite3_column_int64(statement.s, 0);
    entry.camera.model = *model;
    entry.camera.width_px = sqlite3_column_int(statement.s, 2);
    entry.camera.height_px = sqlite3_column_int(statement.s, 3);
    entry.camera.params.resize(static_cast<std::size_t>(ParameterCount(*model)));
    const auto bytes = static_cast<std::size_t>(sqlite3_column_bytes(statement.s, 4));
    if (bytes != entry.camera.params.size() * sizeof(double))
      throw InputError(impl_->path,
                       fmt::format("camera {}: {} bytes of parameters for a {}", entry.id, bytes, Name(*model)));
    std::memcpy(entry.camera.params.data(), sqlite3_column_blob(statement.s, 4), bytes);
    entry.focal_is_known = sqlite3_column_int(statement.s, 5) != 0;
    cameras.push_back(std::move(entry));
  }
  return cameras;
}

void ColmapDatabase::SetFocalLength(std::int64_t camera_id, const Camera& camera) {
  Impl::Statement update;
  impl_->Prepare(update, "UPDATE cameras SET params = ?, prior_focal_length = 1 WHERE camera_id = ?");
  sqlite3_bind_blob(update.s, 1, camera.params.data(), static_cast<int>(camera.params.size() * sizeof(double)),
                    SQLITE_TRANSIENT);
  sqlite3_bind_int64(update.s, 2, camera_id);
  impl_->Step(update);
}

bool ColmapDatabase::HasRigs() const {
  Impl::Statement statement;
  impl_->Prepare(statement, "SELECT COUNT(*) FROM sqlite_master WHERE type = 'table' AND name = 'rigs'");
  return impl_->Step(statement) && sqlite3_column_int(statement.s, 0) > 0;
}

void ColmapDatabase::Rename(const std::map<std::int64_t, std::string>& name_of_image) {
  impl_->Transact([&] {
    for (const auto& [image, name] : name_of_image) {
      Impl::Statement update;
      impl_->Prepare(update, "UPDATE images SET name = ? WHERE image_id = ?");
      sqlite3_bind_text(update.s, 1, name.data(), static_cast<int>(name.size()), SQLITE_TRANSIENT);
      sqlite3_bind_int64(update.s, 2, image);
      impl_->Step(update);
    }
  });
}

void ColmapDatabase::SetCameras(const std::vector<Camera>& cameras, bool focal_is_known,
                                const std::map<std::int64_t, std::size_t>& camera_of_image) {
  impl_->Transact([&] {
    std::vector<std::int64_t> ids;
    for (const Camera& camera : cameras) ids.push_back(impl_->AddCamera(camera, focal_is_known));
    for (const auto& [image, index] : camera_of_image) {
      Impl::Statement update;
      impl_->Prepare(update, "UPDATE images SET camera_id = ? WHERE image_id = ?");
      sqlite3_bind_int64(update.s, 1, ids.at(index));
      sqlite3_bind_int64(update.s, 2, image);
      impl_->Step(update);
    }
    impl_->Execute("DELETE FROM cameras WHERE camera_id NOT IN (SELECT camera_id FROM images)");
  });
}

std::int64_t ColmapDatabase::AddPhoto(const DatabasePhoto& photo) {
  // COLMAP's row: place, and the affine map of the unit disc to the spot (FeatureKeypoint).
  constexpr int kColumns = 6;
  std::vector<float> keypoints;
  for (const SiftFeature& f : photo.features) {
    const double c = f.scale_px * std::cos(f.orientation_rad), s = f.scale_px * std::sin(f.orientation_rad);
    for (const double v : {f.x_px.x(), f.x_px.y(), c, -s, s, c}) keypoints.push_back(static_cast<float>(v));
  }
  const auto rows = static_cast<std::int64_t>(photo.features.size());
  std::int64_t camera_id = photo.camera_id;
  impl_->Transact([&] {
    Impl::Statement image, points, descriptors;
    if (photo.camera) camera_id = impl_->AddCamera(*photo.camera, false);
    impl_->Prepare(image, "INSERT INTO images(image_id, name, camera_id) VALUES(?, ?, ?)");
    sqlite3_bind_int64(image.s, 1, photo.id);
    sqlite3_bind_text(image.s, 2, photo.name.data(), static_cast<int>(photo.name.size()), SQLITE_STATIC);
    sqlite3_bind_int64(image.s, 3, camera_id);
    impl_->Write(image);
    const auto add = [&](Impl::Statement& insert, int columns, const void* data, std::size_t bytes) {
      sqlite3_bind_int64(insert.s, 1, photo.id);
      sqlite3_bind_int64(insert.s, 2, rows);
      sqlite3_bind_int(insert.s, 3, columns);
      Impl::Bind(insert, 4, data, bytes);
      impl_->Write(insert);
    };
    impl_->Prepare(points, "INSERT INTO keypoints(image_id, rows, cols, data) VALUES(?, ?, ?, ?)");
    add(points, kColumns, keypoints.data(), keypoints.size() * sizeof(float));
    impl_->Prepare(descriptors, "INSERT INTO descriptors(image_id, rows, cols, data) VALUES(?, ?, ?, ?)");
    add(descriptors, kByteDescriptorLength, photo.descriptors.data(),
        static_cast<std::size_t>(photo.descriptors.size()));
  });
  return camera_id;
}

void ColmapDatabase::AddPairs(const std::vector<DatabaseMatches>& pairs) {
  const auto bind = [](Impl::Statement& insert, std::int64_t pair, const std::vector<std::uint32_t>& data) {
    sqlite3_bind_int64(insert.s, 1, pair);
    sqlite3_bind_int64(insert.s, 2, static_cast<std::int64_t>(data.size() / 2));
    sqlite3_bind_int(insert.s, 3, 2);
    Impl::Bind(insert, 4, data.data(), data.size() * sizeof(std::uint32_t));
  };
  impl_->Transact([&] {
    Impl::Statement raw, verified;
    impl_->Prepare(raw, "INSERT OR REPLACE INTO matches(pair_id, rows, cols, data) VALUES(?, ?, ?, ?)");
    impl_->Prepare(verified,
                   "INSERT OR REPLACE INTO two_view_geometries(pair_id, rows, cols, data, config, F, E, H, qvec, tvec) "
                   "VALUES(?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
    for (const DatabaseMatches& p : pairs) {
      const std::int64_t id = PairId(p.image1, p.image2);
      const auto matches = AsNumbers(p.matches), inliers = AsNumbers(p.geometry.inliers);
      bind(raw, id, matches);
      impl_->Write(raw);
      bind(verified, id, inliers);
      sqlite3_bind_int(verified.s, 5, static_cast<int>(p.geometry.label));
      // Row by row; no pose (COLMAP's own matcher leaves it at zero, too).
      using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
      const RowMajor F = p.geometry.F, E = p.geometry.E, H = p.geometry.H;
      const Eigen::Matrix<double, 7, 1> pose = Eigen::Matrix<double, 7, 1>::Zero();
      const auto numbers = [&](int at, const double* data, std::size_t count) {
        Impl::Bind(verified, at, data, inliers.empty() ? 0 : count * sizeof(double));
      };
      numbers(6, F.data(), 9);
      numbers(7, E.data(), 9);
      numbers(8, H.data(), 9);
      numbers(9, pose.data(), 4);
      numbers(10, pose.data(), 3);
      impl_->Write(verified);
    }
  });
}

void ColmapDatabase::CopyTo(const std::filesystem::path& path) const {
  Impl::Statement copy;
  impl_->Prepare(copy, "VACUUM INTO ?");
  sqlite3_bind_text(copy.s, 1, path.c_str(), -1, SQLITE_TRANSIENT);
  impl_->Step(copy);
}

void ColmapDatabase::KeepOfVerified(const std::vector<VerifiedMatchesLeft>& pairs) {
  impl_->Transact([&] {
    Impl::Statement update;
    impl_->Prepare(update, "UPDATE two_view_geometries SET rows = ?, data = ? WHERE pair_id = ?");
    for (const VerifiedMatchesLeft& pair : pairs) {
      const std::vector<std::uint32_t> data = AsNumbers(pair.matches);
      sqlite3_bind_int64(update.s, 1, static_cast<std::int64_t>(pair.matches.size()));
      Impl::Bind(update, 2, data.data(), data.size() * sizeof(std::uint32_t));
      sqlite3_bind_int64(update.s, 3, PairId(pair.image1, pair.image2));
      impl_->Write(update);
    }
  });
}

}  // namespace lumi
