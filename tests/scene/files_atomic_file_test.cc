#include "scene/files/atomic_file.h"

#include <sys/wait.h>

#include <chrono>
#include <cstdlib>

#include "files_test_util.h"
#include "scene/files/temporary_folder.h"

namespace lumi::test {
namespace {

TEST(AtomicFile, WritesIntoFoldersThatAreMadeAndReplacesWhatWasThere) {
  const TempFolder folder;
  WriteTextAtomically(folder / "a/b/c.txt", "first, longer");
  WriteTextAtomically(folder / "a/b/c.txt", "second");
  EXPECT_EQ(ReadText(folder / "a/b/c.txt"), "second");
  EXPECT_EQ(CountFiles(folder / "a/b"), 1u);
}

TEST(AtomicFile, AFailingWriterLeavesTheOldFileAndNothingElse) {
  const TempFolder folder;
  WriteTextAtomically(folder / "c.txt", "old");
  EXPECT_THROW(WriteFileAtomically(folder / "c.txt",
                                   [](const fs::path& temporary) {
                                     Write(temporary, "half");
                                     throw Interrupted();
                                   }),
               Interrupted);
  EXPECT_EQ(ReadText(folder / "c.txt"), "old");
  EXPECT_EQ(CountFiles(folder.path()), 1u);
}

TEST(AtomicFile, AFullDiskNamesTheFileAndLeavesNothingHalfWritten) {
  const TempFolder folder;
  WriteTextAtomically(folder / "c.txt", "old");
  const FileSizeLimit limit(1000);
  EXPECT_REFUSED(ExitCode::kMachine, "c.txt", WriteTextAtomically(folder / "c.txt", std::string(5000, 'x')));
  EXPECT_EQ(ReadText(folder / "c.txt"), "old");
  EXPECT_EQ(CountFiles(folder.path()), 1u);
}

TEST(AtomicFile, NeitherAFolderNorADeviceIsReplaced) {
  const TempFolder folder;
  fs::create_directory(folder / "here");
  EXPECT_REFUSED(ExitCode::kMachine, "here", WriteTextAtomically(folder / "here", "x"));
  EXPECT_REFUSED(ExitCode::kMachine, "/dev/null", WriteTextAtomically("/dev/null", "x"));
  Write(folder / "file", "");
  EXPECT_REFUSED(ExitCode::kMachine, "file/x", WriteTextAtomically(folder / "file/x", "x"));
}

TEST(AtomicFile, TemporariesOfDeadProcessesAreRemovedAndThoseOfLivingOnesKept) {
  const TempFolder folder;
  const pid_t child = ::fork();
  if (child == 0) ::_exit(0);
  ::waitpid(child, nullptr, 0);
  Write(folder / (".a.lumi-tmp-" + std::to_string(child) + "-0.jpg"), "x");
  Write(folder / (".b.lumi-tmp-" + std::to_string(::getpid()) + "-0.jpg"), "x");
  Write(folder / "c.jpg", "x");
  RemoveStaleTemporaries(folder.path());
  EXPECT_EQ(CountFiles(folder.path()), 2u);
  EXPECT_TRUE(fs::exists(folder / "c.jpg"));
}

// A process number that nobody has.
pid_t GonePid() {
  const pid_t child = ::fork();
  if (child == 0) ::_exit(0);
  ::waitpid(child, nullptr, 0);
  return child;
}

std::string TemporaryOf(const std::string& name, pid_t pid) {
  return "." + name + ".lumi-tmp-" + std::to_string(pid) + "-0.jpg";
}

TEST(AtomicFile, ATemporaryInAFolderThatIsInUseIsKeptWhoeverWritesIt) {
  const TempFolder folder;
  Write(folder / "sub" / TemporaryOf("a", GonePid()), "x");  // of another container, as far as can be told
  {
    const FolderInUse in_use(folder / "sub");
    RemoveStaleTemporaries(folder.path());
    EXPECT_EQ(CountFiles(folder / "sub"), 1u);
  }
  RemoveStaleTemporaries(folder.path());
  EXPECT_EQ(CountFiles(folder / "sub"), 0u);
}

TEST(AtomicFile, WhileAFileIsWrittenItsFolderIsInUse) {
  const TempFolder folder;
  WriteFileAtomically(folder / "file", [&](const fs::path& temporary) {
    Write(folder / TemporaryOf("other", GonePid()), "x");
    RemoveStaleTemporaries(folder.path());
    EXPECT_EQ(CountFiles(folder.path()), 1u);
    Write(temporary, "y");
  });
}

TEST(AtomicFile, WhoFirstWritesIntoAFolderRemovesWhatKilledRunsLeftThere) {
  const TempFolder folder;
  const pid_t gone = GonePid();
  Write(folder / TemporaryOf("other", gone), "x");
  Write(folder / "sub" / TemporaryOf("other", gone), "x");
  Write(folder / "parts" / TemporaryOf("other", gone), "x");
  Write(folder / "parts" / kMadeInParts, "");
  WriteTextAtomically(folder / "file", "y");
  EXPECT_EQ(CountFiles(folder.path()), 3u);  // the file and the folders
  EXPECT_EQ(CountFiles(folder / "sub"), 1u);
  WriteTextAtomically(folder / "sub/file", "y");
  EXPECT_EQ(CountFiles(folder / "sub"), 1u);
  WriteTextAtomically(folder / "parts/file", "y");
  EXPECT_EQ(CountFiles(folder / "parts"), 3u);  // another machine's, perhaps
}

TEST(AtomicFile, AProcessNumberThatWasGivenAnewKeepsATemporaryForADay) {
  const TempFolder folder;
  const fs::path old = folder / TemporaryOf("old", ::getpid());
  Write(old, "x");
  fs::last_write_time(old, fs::file_time_type::clock::now() - std::chrono::hours(25));
  Write(folder / TemporaryOf("new", ::getpid()), "x");
  RemoveStaleTemporaries(folder.path());
  EXPECT_FALSE(fs::exists(old));
  EXPECT_EQ(CountFiles(folder.path()), 1u);
}

TEST(AtomicFile, TheTemporariesOfOneFileAreFoundBesideIt) {
  const TempFolder folder;
  const pid_t gone = GonePid();
  for (const std::string& name : {TemporaryOf("a", gone), "." + TemporaryOf("a", gone), TemporaryOf("ab", gone)})
    Write(folder / name, "x");
  RemoveStaleTemporariesOf(folder / "a.jpg");
  EXPECT_EQ(CountFiles(folder.path()), 1u);
  EXPECT_TRUE(fs::exists(folder / TemporaryOf("ab", gone)));
}

TEST(AtomicFile, WhoLocksAFolderRemovesWhatKilledRunsLeftInIt) {
  const TempFolder folder;
  Write(folder / "images" / TemporaryOf("a", GonePid()), "x");
  const FolderLock lock(folder.path());
  EXPECT_EQ(CountFiles(folder / "images"), 0u);
}

TEST(FlushToDisk, TakesFilesFoldersAndNamesThatAreNotThere) {
  const TempFolder folder;
  for (int i = 0; i < 100; ++i) Write(folder / "images" / (std::to_string(i) + ".jpg"), "x");
  Write(folder / "file", "x");
  FlushToDisk(folder.path(), {folder / "file", folder / "absent"});
  FlushToDisk(folder.path(), {folder / "file", folder / "images"});
  FlushToDisk(folder.path() / "", {folder / "file"});
}

TEST(TemporaryFolder, RemovesThoseThatKilledProcessesLeftLongAgo) {
  const TempFolder among;
  const char* const before = std::getenv("TMPDIR");
  const std::string kept = before ? before : "";
  ::setenv("TMPDIR", among.path().c_str(), 1);
  const auto long_ago = fs::file_time_type::clock::now() - std::chrono::hours(2);
  for (const char* name : {"lumigraph-abandoned", "lumigraph-new", "other"}) Write(among / name / "file", "x");
  const TemporaryFolder used;
  for (const fs::path& old : {among / "lumigraph-abandoned", among / "other", used.path()})
    fs::last_write_time(old, long_ago);
  {
    const TemporaryFolder another;
    EXPECT_FALSE(fs::exists(among / "lumigraph-abandoned"));
    for (const fs::path& there : {among / "lumigraph-new", among / "other", used.path()})
      EXPECT_TRUE(fs::exists(there));
  }
  before ? ::setenv("TMPDIR", kept.c_str(), 1) : ::unsetenv("TMPDIR");
}

TEST(ReadText, RefusesWhatIsAbsentAFolderOrTooLarge) {
  const TempFolder folder;
  Write(folder / "ten", "0123456789");
  EXPECT_EQ(ReadText(folder / "ten", 10), "0123456789");
  EXPECT_REFUSED(ExitCode::kCorruptInput, "ten", ReadText(folder / "ten", 9));
  EXPECT_REFUSED(ExitCode::kCorruptInput, "absent", ReadText(folder / "absent"));
  EXPECT_REFUSED(ExitCode::kCorruptInput, "folder", ReadText(folder.path()));
  EXPECT_REFUSED(ExitCode::kCorruptInput, "/dev/zero", ReadText("/dev/zero", 100));
}

TEST(FolderLock, ASecondOwnerIsRefusedByTheFirstOnesProcessIdAndTheLockGoesWithIt) {
  const TempFolder folder;
  {
    const FolderLock lock(folder / "scene");
    EXPECT_REFUSED(ExitCode::kMachine, std::to_string(::getpid()), FolderLock again(folder / "scene"));
  }
  EXPECT_EQ(CountFiles(folder / "scene"), 0u);
  const FolderLock lock(folder / "scene");
}

TEST(FolderLock, AKilledOwnerHoldsNothing) {
  const TempFolder folder;
  int ready[2];
  ASSERT_EQ(::pipe(ready), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    const FolderLock lock(folder.path());
    if (::write(ready[1], "x", 1) != 1) ::_exit(1);
    for (;;) ::pause();
  }
  char byte;
  ASSERT_EQ(::read(ready[0], &byte, 1), 1);
  EXPECT_REFUSED(ExitCode::kMachine, std::to_string(child), FolderLock taken(folder.path()));
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  ::close(ready[0]);
  ::close(ready[1]);
  EXPECT_TRUE(fs::exists(folder / "LOCK"));
  const FolderLock lock(folder.path());
}

TEST(RequireOurFolder, TakesNewEmptyAndOwnFoldersAndLeavesOthersAlone) {
  const TempFolder folder;
  RequireOurFolder(folder / "new");
  EXPECT_FALSE(fs::exists(folder / "new"));
  RequireOurFolder(folder.path());
  Write(folder / "LOCK", "1\n");
  Write(folder / ".lumigraph.lumi-tmp-1-0.json", "{");
  RequireOurFolder(folder.path());
  Write(folder / "letter.txt", "Dear");
  EXPECT_REFUSED(ExitCode::kUsage, "letter.txt", RequireOurFolder(folder.path()));
  EXPECT_REFUSED(ExitCode::kUsage, "letter.txt", RequireOurFolder(folder / "letter.txt"));
  Write(folder / "mine.json", "{}");
  RequireOurFolder(folder.path(), "mine.json");
  Write(folder / "lumigraph.json", "{}");
  RequireOurFolder(folder.path());
}

}  // namespace
}  // namespace lumi::test
