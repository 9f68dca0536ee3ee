// A COLMAP database of our own making, with 3.8's tables.
#pragma once

#include <gtest/gtest.h>
#include <sqlite3.h>

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace lumi {

class TestDatabase {
 public:
  explicit TestDatabase(const std::filesystem::path& path) {
    EXPECT_EQ(sqlite3_open(path.c_str(), &db_), SQLITE_OK);
    Run("PRAGMA synchronous = OFF");
    Run("PRAGMA journal_mode = OFF");
    Run("CREATE TABLE cameras (camera_id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, model INTEGER NOT NULL, width "
        "INTEGER NOT NULL, height INTEGER NOT NULL, params BLOB, prior_focal_length INTEGER NOT NULL)");
    Run("CREATE TABLE images (image_id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, name TEXT NOT NULL UNIQUE, "
        "camera_id INTEGER NOT NULL)");
    Run("CREATE TABLE keypoints (image_id INTEGER PRIMARY KEY NOT NULL, rows INTEGER NOT NULL, cols INTEGER NOT NULL, "
        "data BLOB)");
    Run("CREATE TABLE descriptors (image_id INTEGER PRIMARY KEY NOT NULL, rows INTEGER NOT NULL, cols INTEGER NOT "
        "NULL, data BLOB)");
    Run("CREATE TABLE matches (pair_id INTEGER PRIMARY KEY NOT NULL, rows INTEGER NOT NULL, cols INTEGER NOT NULL, "
        "data BLOB)");
    Run("CREATE TABLE two_view_geometries (pair_id INTEGER PRIMARY KEY NOT NULL, rows INTEGER NOT NULL, cols INTEGER "
        "NOT NULL, data BLOB, config INTEGER NOT NULL)");
  }
  ~TestDatabase() { sqlite3_close(db_); }

  void Run(const std::string& sql) {
    ASSERT_EQ(sqlite3_exec(db_, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK)
        << sqlite3_errmsg(db_) << ": " << sql;
  }
  void AddImage(int id, const std::string& name, const std::vector<Eigen::Vector2d>& keypoints) {
    Run("INSERT INTO images VALUES(" + std::to_string(id) + ", '" + name + "', 1)");
    std::vector<float> data;
    for (const auto& x : keypoints)
      data.insert(data.end(), {static_cast<float>(x.x()), static_cast<float>(x.y()), 1.0F, 0.0F});
    Blob("INSERT INTO keypoints VALUES(" + std::to_string(id) + ", " + std::to_string(keypoints.size()) + ", 4, ?)",
         data.data(), data.size() * sizeof(float));
  }
  void AddImage(int id, const std::string& name, int keypoints) {
    AddImage(id, name, std::vector<Eigen::Vector2d>(static_cast<std::size_t>(keypoints), Eigen::Vector2d(1, 1)));
  }
  void AddDescriptors(int id, const std::vector<std::uint8_t>& data, int columns) {
    Blob("INSERT INTO descriptors VALUES(" + std::to_string(id) + ", " +
             std::to_string(data.size() / static_cast<std::size_t>(columns)) + ", " + std::to_string(columns) + ", ?)",
         data.data(), data.size());
  }
  void AddMatches(std::int64_t a, std::int64_t b, const std::vector<std::pair<int, int>>& matches) {
    std::vector<std::uint32_t> data;
    for (const auto& [i, j] : matches)
      data.insert(data.end(), {static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j)});
    const std::string pair = std::to_string(a * 2147483647 + b), rows = std::to_string(matches.size());
    Blob("INSERT INTO matches VALUES(" + pair + ", " + rows + ", 2, ?)", data.data(), data.size() * 4);
    Blob("INSERT INTO two_view_geometries VALUES(" + pair + ", " + rows + ", 2, ?, 2)", data.data(), data.size() * 4);
  }
  void AddMatches(std::int64_t a, std::int64_t b, int count) {
    AddMatches(a, b, std::vector<std::pair<int, int>>(static_cast<std::size_t>(count), {0, 0}));
  }

 private:
  void Blob(const std::string& sql, const void* data, std::size_t size) {
    sqlite3_stmt* statement = nullptr;
    ASSERT_EQ(sqlite3_prepare_v2(db_, sql.c_str(), -1, &statement, nullptr), SQLITE_OK) << sqlite3_errmsg(db_);
    sqlite3_bind_blob(statement, 1, data, static_cast<int>(size), SQLITE_TRANSIENT);
    ASSERT_EQ(sqlite3_step(statement), SQLITE_DONE) << sqlite3_errmsg(db_);
    sqlite3_finalize(statement);
  }
  sqlite3* db_ = nullptr;
};

// A folder that is gone after the test.
class FixtureFolder {
 public:
  explicit FixtureFolder(const std::string& name)
      : path_(std::filesystem::temp_directory_path() / ("lumi-" + name + "-" + std::to_string(::getpid()))) {
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~FixtureFolder() {
    std::error_code ec;
    std::filesystem::remove_all(path_, ec);
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace lumi
