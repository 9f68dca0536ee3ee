#include "scene/files/provenance.h"

#include "files_test_util.h"
#include "scene/program/printable.h"

namespace lumi::test {
namespace {

Provenance Example(const TempFolder& folder) {
  Provenance p;
  p.stage = std::string("proxy-auto");
  p.version = std::string("1.2");
  p.options = {{"k", "4"}, {"name", "auto"}};
  p.inputs = {{"in.txt", Fingerprint(folder / "in.txt")}};
  p.outputs = {{"out.txt", Fingerprint(folder / "out.txt")}};
  p.seconds = 1.5;
  return p;
}

TEST(Fingerprint, FollowsTheContentOfAFileNotItsTime) {
  const TempFolder folder;
  Write(folder / "a", "content");
  const std::string before = Fingerprint(folder / "a");
  fs::last_write_time(folder / "a", fs::last_write_time(folder / "a") - std::chrono::hours(1));
  EXPECT_EQ(Fingerprint(folder / "a"), before);
  Write(folder / "a", "Content");
  EXPECT_NE(Fingerprint(folder / "a"), before);
  EXPECT_EQ(Fingerprint(folder / "b"), "absent");
}

TEST(Fingerprint, SeesALargeFileGrowOrChangeAtItsEnd) {
  const TempFolder folder;
  std::string large(3 << 20, 'x');
  Write(folder / "a", large);
  const auto time = fs::last_write_time(folder / "a");
  const std::string before = Fingerprint(folder / "a");
  EXPECT_EQ(Fingerprint(folder / "a"), before);
  large.back() = 'y';
  Write(folder / "a", large);
  fs::last_write_time(folder / "a", time);
  EXPECT_NE(Fingerprint(folder / "a"), before);
  large[1 << 20] = 'y';  // in the middle: the time tells
  Write(folder / "a", large);
  fs::last_write_time(folder / "a", time + std::chrono::seconds(1));
  EXPECT_NE(Fingerprint(folder / "a"), before);
}

TEST(Fingerprint, OfManyFilesSeesSizesTimesAndEndsAndDoesNotReadThemWhole) {
  const TempFolder folder;
  const fs::path file = folder / "photo.jpg";
  std::string bytes(300000, 'x');
  Write(file, bytes);
  const auto time = fs::last_write_time(file);
  const std::string few = Fingerprint(file), many = FingerprintAmong(file, kManyFiles + 1);
  EXPECT_EQ(FingerprintAmong(file, kManyFiles), few);
  bytes[150000] = 'y';  // in the middle, and the time put back
  Write(file, bytes);
  fs::last_write_time(file, time);
  EXPECT_NE(Fingerprint(file), few);
  EXPECT_EQ(FingerprintAmong(file, kManyFiles + 1), many) << "the middle is not read";
  bytes[10] = 'y';
  Write(file, bytes);
  fs::last_write_time(file, time);
  EXPECT_NE(FingerprintAmong(file, kManyFiles + 1), many);
  fs::last_write_time(file, time + std::chrono::seconds(1));
  EXPECT_NE(FingerprintAmong(file, kManyFiles + 1), many);
  // Small files are read whole among any number.
  const fs::path small = folder / "small.txt";
  Write(small, "a");
  EXPECT_EQ(FingerprintAmong(small, kManyFiles + 1), Fingerprint(small));
}

TEST(Fingerprint, OfAFolderSeesNamesAndContentsButNoLocks) {
  const TempFolder folder;
  Write(folder / "d/a", "1");
  Write(folder / "d/sub/b", "2");
  const std::string before = Fingerprint(folder / "d");
  Write(folder / "d/LOCK", "77");
  Write(folder / "d/.a.lumi-tmp-7-0", "77");
  EXPECT_EQ(Fingerprint(folder / "d"), before);
  Write(folder / "d/sub/b", "3");
  EXPECT_NE(Fingerprint(folder / "d"), before);
  Write(folder / "d/sub/b", "2");
  EXPECT_EQ(Fingerprint(folder / "d"), before);
  fs::rename(folder / "d/sub/b", folder / "d/sub/c");
  EXPECT_NE(Fingerprint(folder / "d"), before);
}

TEST(Provenance, KeepsNamesAndValuesOfAnyBytes) {
  const TempFolder folder;
  const std::string latin = "caf\xe9 \\x41.txt";
  Write(folder / latin, "1");
  Provenance p = Example(folder);
  for (const std::string& text : {latin, std::string("caf\\xe9"), std::string("bytes:a"), std::string("bytes:\xff")})
    p.options[text] = p.inputs[text] = text;
  p.outputs = {{latin, Fingerprint(folder / latin)}};
  WriteProvenance(folder.path(), p);
  EXPECT_TRUE(IsUtf8(ReadText(folder / "provenance" / (p.stage + ".json"))));
  const auto read = ReadProvenance(folder.path(), p.stage);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->options, p.options);
  EXPECT_EQ(read->inputs, p.inputs);
  EXPECT_EQ(read->outputs, p.outputs);
  EXPECT_TRUE(IsUpToDate(folder.path(), p));
  Write(folder / latin, "2");
  std::string why;
  EXPECT_FALSE(IsUpToDate(folder.path(), p, &why));
  EXPECT_EQ(why, "output caf\\xe9 \\x41.txt is not as it was written");
}

TEST(Provenance, WhatIsRecordedIsUpToDateUntilAnythingChanges) {
  const TempFolder folder;
  Write(folder / "in.txt", "in");
  Write(folder / "out.txt", "out");
  std::string why;
  EXPECT_FALSE(IsUpToDate(folder.path(), Example(folder), &why));
  EXPECT_NE(why.find("not been run"), std::string::npos) << why;
  WriteProvenance(folder.path(), Example(folder));
  Provenance wanted = Example(folder);
  wanted.outputs.clear();  // they are what the record says
  wanted.seconds = 0;
  EXPECT_TRUE(IsUpToDate(folder.path(), wanted, &why)) << why;

  const auto stale = [&](auto change, const char* reason) {
    Provenance other = wanted;
    change(other);
    EXPECT_FALSE(IsUpToDate(folder.path(), other, &why));
    EXPECT_NE(why.find(reason), std::string::npos) << why;
  };
  stale([](Provenance& p) { p.version = std::string("1.3"); }, "version 1.2");
  stale([](Provenance& p) { p.options["k"] = std::string("8"); }, "option k changed from 4 to 8");
  stale([](Provenance& p) { p.options["new"] = std::string("8"); }, "option new is new");
  stale([](Provenance& p) { p.options.erase("name"); }, "option name is gone");
  stale([](Provenance& p) { p.inputs["in.txt"] = std::string("other"); }, "input in.txt");
  stale([](Provenance& p) { p.stage = std::string("proxy-plane"); }, "not been run");
  Write(folder / "out.txt", "touched");
  stale([](Provenance&) {}, "output out.txt");
  fs::remove(folder / "out.txt");
  stale([](Provenance&) {}, "output out.txt");
  Write(folder / "provenance/proxy-auto.json", "{ torn");
  stale([](Provenance&) {}, "record");
}

}  // namespace
}  // namespace lumi::test
