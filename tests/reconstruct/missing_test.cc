#include "reconstruct/missing.h"

#include "database_fixture.h"
#include "scene/files/atomic_file.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

Capture PhotosNamed(const std::vector<std::string>& names) {
  Capture capture;
  for (const auto& name : names) {
    InputPhoto photo;
    photo.name = name;
    capture.photos.push_back(photo);
  }
  return capture;
}

TEST(Missing, EachPhotoIsToldItsOwnReason) {
  const FixtureFolder folder("missing");
  {
    TestDatabase db(folder.path() / "database.db");
    db.AddImage(1, "a.jpg", 3000);
    db.AddImage(2, "b.jpg", 3100);
    db.AddImage(3, "blurred.jpg", 40);
    db.AddImage(4, "far.jpg", 2900);
    db.AddImage(5, "alone.jpg", 2800);
    db.AddImage(6, "other1.jpg", 3000);
    db.AddImage(7, "other2.jpg", 3000);
    db.AddImage(8, "twin.jpg", 3000);
    db.AddMatches(1, 2, 900);
    db.AddMatches(1, 4, 17);
    db.AddMatches(2, 4, 22);
    db.AddMatches(4, 6, 400);  // with a photo that has no camera: no help
    db.AddMatches(6, 7, 500);
    db.AddMatches(1, 8, 300);
  }
  Capture capture = PhotosNamed({"a.jpg", "alone.jpg", "b.jpg", "blurred.jpg", "far.jpg", "other1.jpg", "other2.jpg",
                                 "turned-away.jpg", "twin.jpg"});
  capture.unreadable.push_back({"half.jpg", "unreadable: truncated", ""});
  const auto missing = ExplainMissing(capture, ColmapDatabase(folder.path() / "database.db"), {"a.jpg", "b.jpg"},
                                      {{"other1.jpg", "other2.jpg"}});
  std::map<std::string, std::string> reason;
  for (const auto& m : missing) {
    reason[m.name] = m.reason;
    if (m.name != "half.jpg") {
      EXPECT_FALSE(m.hint.empty()) << m.name;
    }
  }
  EXPECT_EQ(reason.size(), 8u);
  EXPECT_EQ(reason.count("a.jpg"), 0u);
  EXPECT_NE(reason["blurred.jpg"].find("blurred or textureless (40 features"), std::string::npos)
      << reason["blurred.jpg"];
  EXPECT_NE(reason["far.jpg"].find("too few matches (best: 22 inliers with b.jpg)"), std::string::npos)
      << reason["far.jpg"];
  EXPECT_NE(reason["alone.jpg"].find("too few matches (none"), std::string::npos) << reason["alone.jpg"];
  EXPECT_NE(reason["other1.jpg"].find("other component"), std::string::npos) << reason["other1.jpg"];
  EXPECT_NE(reason["other1.jpg"].find("other2.jpg"), std::string::npos) << reason["other1.jpg"];
  EXPECT_NE(reason["turned-away.jpg"].find("unreadable"), std::string::npos);
  EXPECT_NE(reason["twin.jpg"].find("did not fit (300 inliers"), std::string::npos) << reason["twin.jpg"];
  EXPECT_NE(reason["half.jpg"].find("truncated"), std::string::npos);
}

TEST(Database, AFileThatIsNoneIsRefused) {
  const FixtureFolder folder("nodb");
  WriteTextAtomically(folder.path() / "text.db",
                      "this is no database, whatever its name says, and long enough to be read");
  EXPECT_FALSE(ColmapDatabase::IsDatabase(folder.path() / "text.db"));
  EXPECT_FALSE(ColmapDatabase::IsDatabase(folder.path() / "absent.db"));
  EXPECT_FALSE(ColmapDatabase::IsDatabase(folder.path()));
  EXPECT_THROW(ColmapDatabase(folder.path() / "text.db"), InputError);
}

TEST(Database, CountsThatLieAreRefused) {
  const FixtureFolder folder("lying");
  {
    TestDatabase db(folder.path() / "database.db");
    db.AddImage(1, "a.jpg", 10);
    db.AddImage(2, "b.jpg", 10);
    db.AddMatches(1, 2, 5);
    db.Run("UPDATE keypoints SET rows = 1000000000 WHERE image_id = 1");
    db.Run("UPDATE matches SET rows = 1000000000");
  }
  const ColmapDatabase db(folder.path() / "database.db");
  EXPECT_THROW(db.Keypoints(1), InputError);
  EXPECT_EQ(db.Keypoints(2).size(), 10u);
  EXPECT_THROW(db.Matches(1, 2), InputError);
  EXPECT_TRUE(db.Keypoints(77).empty());
}

TEST(Database, DescriptorsAreReadAndThoseOfAnotherKindRefused) {
  const FixtureFolder folder("descriptors");
  std::vector<std::uint8_t> bytes(3 * 128);
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(i % 251);
  {
    TestDatabase db(folder.path() / "database.db");
    db.AddImage(1, "a.jpg", 3);
    db.AddDescriptors(1, bytes, 128);
    db.AddDescriptors(2, bytes, 64);
    db.AddDescriptors(3, bytes, 128);
    db.Run("UPDATE descriptors SET rows = 1000000000 WHERE image_id = 3");
  }
  const ColmapDatabase db(folder.path() / "database.db");
  const auto found = db.Descriptors(1);
  ASSERT_EQ(found.rows(), 3);
  for (Eigen::Index i = 0; i < found.size(); ++i) ASSERT_EQ(found.data()[i], bytes[static_cast<std::size_t>(i)]);
  EXPECT_THROW(db.Descriptors(2), InputError);
  EXPECT_THROW(db.Descriptors(3), InputError);
  EXPECT_EQ(db.Descriptors(77).rows(), 0);
}

TEST(Database, ReadingTheUsersOwnLeavesNothingBesideIt) {
  const FixtureFolder folder("theirs");
  { TestDatabase(folder.path() / "database.db").AddImage(1, "a.jpg", 3); }
  const auto before = std::filesystem::last_write_time(folder.path() / "database.db");
  {
    const ColmapDatabase db(folder.path() / "database.db", ColmapDatabase::Access::kTheirs);
    EXPECT_EQ(db.Images().size(), 1u);
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
  }
  EXPECT_EQ(std::filesystem::last_write_time(folder.path() / "database.db"), before);
}

TEST(Database, CamerasAreReplacedAllAtOnce) {
  const FixtureFolder folder("cameras");
  {
    TestDatabase db(folder.path() / "database.db");
    db.AddImage(1, "a.jpg", 3);
    db.AddImage(2, "b.jpg", 3);
  }
  ColmapDatabase db(folder.path() / "database.db");
  db.SetCameras({Camera::Pinhole(640, 480, 500, 500, 320, 240)}, true, {{1, 0}, {2, 0}});
  const auto images = db.Images();
  ASSERT_EQ(images.size(), 2u);
  EXPECT_EQ(images[0].camera_id, images[1].camera_id);
}

}  // namespace
}  // namespace lumi
