#include "scene/program/main_program.h"

#include <signal.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <new>
#include <nlohmann/json.hpp>

#include "scene/files/atomic_file.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/out_of_memory.h"
#include "scene/program/printable.h"
#include "scene/program/with_error.h"

namespace lumi {
namespace {

struct Outcome {
  int code = 0;
  std::string out, err;
};

Outcome Start(std::vector<std::string> args, const std::function<std::string()>& body) {
  args.insert(args.begin(), "lumi-test");
  std::vector<char*> argv;
  for (auto& a : args) argv.push_back(a.data());
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  Program program("lumi-test", "a test");
  Outcome o;
  o.code =
      program.Run(static_cast<int>(argv.size()), argv.data(), [&] { return Answer(*JsonKeys::Parse(body()), ""); });
  o.out = testing::internal::GetCapturedStdout();
  o.err = testing::internal::GetCapturedStderr();
  return o;
}

TEST(Program, ExitCodesAreTheContracts) {
  EXPECT_EQ(Start({}, [] { return "{}"; }).code, 0);
  EXPECT_EQ(Start({}, []() -> std::string { throw DataError("no"); }).code, 1);
  EXPECT_EQ(Start({"--no-such-option"}, [] { return "{}"; }).code, 2);
  EXPECT_EQ(Start({}, []() -> std::string { throw InputError("f.bin", "bad"); }).code, 3);
  EXPECT_EQ(Start({}, []() -> std::string { throw MachineError("full"); }).code, 4);
  EXPECT_EQ(Start({}, []() -> std::string { throw std::logic_error("oops"); }).code, 5);
  EXPECT_EQ(Start({}, []() -> std::string { throw Interrupted(); }).code, 130);
}

// A library that asks for memory, gets none, and says nothing of it: what comes after is not to be trusted.
void FailToAllocate() {
  try {
    std::get_new_handler()();
  } catch (const std::bad_alloc&) {
  }
}

TEST(Program, AnAllocationThatFailedUnseenIsStillOutOfMemory) {
  const TemporaryFolder folder;
  const auto run = [](const std::function<std::string()>& body) {
    const Outcome o = Start({}, body);
    MemoryIsBack();
    return o;
  };
  const Outcome silent = run([] {
    FailToAllocate();
    return "{}";
  });
  EXPECT_EQ(silent.code, 4);
  EXPECT_EQ(silent.err, "lumi-test: out of memory (use smaller photos or fewer of them)\n");
  const Outcome otherwise = run([]() -> std::string {
    FailToAllocate();
    throw InputError("f.bin", "is truncated or corrupt");
  });
  EXPECT_EQ(otherwise.code, 4);
  EXPECT_EQ(otherwise.err, "lumi-test: f.bin: out of memory (use smaller photos or fewer of them)\n");
  const auto write = [&](bool known) {
    return run([&] {
             FailToAllocate();
             if (known) MemoryIsBack();
             WriteTextAtomically(folder / "written", "all of it");
             return "{}";
           })
        .code;
  };
  EXPECT_EQ(write(false), 4);
  EXPECT_FALSE(std::filesystem::exists(folder / "written"));
  EXPECT_EQ(write(true), 0);
  EXPECT_TRUE(std::filesystem::exists(folder / "written"));
}

TEST(Program, ACrashAfterAnAllocationThatFailedIsOutOfMemoryToo) {
  const auto end = [](bool fails, bool crashes) {
    std::vector<char*> argv{const_cast<char*>("lumi-test")};
    Program("lumi-test", "a test").Run(1, argv.data(), [&]() -> Answer {
      if (fails) FailToAllocate();
      const EndsWhereMemoryRunsOut no_way_back;
      if (crashes) ::raise(SIGSEGV);
      std::get_new_handler()();
      return Answer(JsonKeys(), "");
    });
    std::_Exit(0);
  };
  const char* const said = "^lumi-test: out of memory [(]use smaller photos or fewer of them[)]\n$";
  EXPECT_EXIT(end(true, true), testing::ExitedWithCode(4), said);
  EXPECT_EXIT(end(false, false), testing::ExitedWithCode(4), said) << "where nothing can be unwound";
  EXPECT_EXIT(end(false, true), testing::KilledBySignal(SIGSEGV), "") << "a crash of any other kind";
}

TEST(Program, AFailureIsOneLineThatNamesTheFileAndTheWayOut) {
  const Outcome o = Start(
      {"--quiet"}, []() -> std::string { throw InputError("scene/points3D.bin", "holds 12 bytes", "copy it again"); });
  EXPECT_EQ(o.err, "lumi-test: scene/points3D.bin: holds 12 bytes (copy it again)\n");
  EXPECT_EQ(o.out, "");
}

TEST(Program, JsonHasSchemaAndVersionAndAFailureItsError) {
  const auto ok = nlohmann::json::parse(Start({"--json"}, [] { return R"({"frames": 3})"; }).out);
  EXPECT_EQ(ok["schema"], "lumi-test");
  EXPECT_TRUE(ok.contains("version"));
  EXPECT_EQ(ok["frames"], 3);
  const auto bad = nlohmann::json::parse(
      Start({"--json"}, []() -> std::string { throw DataError("two photos do not overlap", "shoot more"); }).out);
  EXPECT_EQ(bad["error"]["code"], 1);
  EXPECT_EQ(bad["error"]["message"], "two photos do not overlap");
  EXPECT_EQ(bad["error"]["hint"], "shoot more");
}

TEST(Program, TheHelpShowsWhatMostPeopleUse) {
  const auto help = [](const char* which) {
    std::vector<std::string> words{"lumi-test", which};
    std::vector<char*> argv{words[0].data(), words[1].data()};
    Program program("lumi-test", "a test");
    int width = 0, rare = 0;
    program.options().Add("--width", width, "Of the picture");
    program.options().Add("--rarely-used", rare, "Of nothing");
    program.options().Common({"--width"});
    program.options().Examples("lumi-test --width 3\nlumi-test");
    testing::internal::CaptureStdout();
    EXPECT_EQ(program.Run(2, argv.data()), 0);
    return testing::internal::GetCapturedStdout();
  };
  const std::string text = help("--help"), all = help("--help-all");
  EXPECT_NE(text.find("--width"), std::string::npos);
  EXPECT_NE(text.find("--json"), std::string::npos);
  EXPECT_EQ(text.find("--rarely-used"), std::string::npos) << text;
  EXPECT_NE(text.find("more: lumi-test --help-all"), std::string::npos) << text;
  EXPECT_NE(text.find("Examples:\n  lumi-test --width 3\n  lumi-test\n"), std::string::npos) << text;
  EXPECT_NE(all.find("--rarely-used"), std::string::npos) << all;
}

TEST(Program, HelpAndVersionAreNoErrors) {
  const Outcome o = Start({"--help"}, [] { return "{}"; });
  EXPECT_EQ(o.code, 0);
  EXPECT_NE(o.out.find("--threads"), std::string::npos);
  EXPECT_EQ(Start({"--version"}, [] { return "{}"; }).code, 0);
}

// ---- what is wrong with a line

// A program with options and two commands.
Outcome StartWithOptions(std::vector<std::string> args) {
  args.insert(args.begin(), "lumi-test");
  std::vector<char*> argv;
  for (auto& a : args) argv.push_back(a.data());
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  Program program("lumi-test", "a test");
  int width = 0, faces = 0;
  std::string input, show;
  enum class Kind { kRound, kSquare } kind = Kind::kRound;
  program.options().Add("INPUT", input, "What");
  program.options().Add("-w,--width", width, "Pixels").Range(1, 100);
  program.options().Add("--show", show, "What is shown").OneOf({"color", "tessellation"});
  program.options().Add("--kind", kind, "Of what", {{"round", Kind::kRound}, {"square", Kind::kSquare}});
  Options simplify = program.Command("simplify", "Fewer", [] { return Answer(JsonKeys(), "fewer"); }, {"--width"});
  simplify.Add("--faces", faces, "How many");
  program.options().Group("Shared").Add("--depth", faces, "Of both");
  program.Command("info", "Says", [] { return Answer(JsonKeys(), "said"); }, {"--show", "Shared"});
  Outcome o;
  o.code = program.Run(static_cast<int>(argv.size()), argv.data(), [&] {
    Answer answer(JsonKeys(), "width " + std::to_string(width) + "\nand more");
    answer.result = kind == Kind::kSquare ? "square" : "";
    return answer;
  });
  o.out = testing::internal::GetCapturedStdout();
  o.err = testing::internal::GetCapturedStderr();
  return o;
}

TEST(CommandLine, NamesTheOptionThatIsNoneAndTheOneThatWasMeant) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
      {{"in", "--widht", "320"}, "--widht is no option of lumi-test (did you mean --width? see lumi-test --help)"},
      {{"in", "--Width=3"}, "--Width is no option of lumi-test (did you mean --width? see lumi-test --help)"},
      {{"in", "-q"}, "-q is no option of lumi-test (see lumi-test --help)"},
      {{"in", "--frobnicate"}, "--frobnicate is no option of lumi-test (see lumi-test --help)"},
      {{"in", "--faces", "3"}, "--faces is no option of lumi-test (it is one of lumi-test simplify)"},
      {{"simplify", "--face", "3"},
       "--face is no option of lumi-test simplify (did you mean --faces? see lumi-test simplify --help)"},
      {{"simplify", "--widt", "3"}, "did you mean --width?"},
      {{"in", "out"}, "\"out\" is one argument too many (see lumi-test --help)"},
      {{"in", "--width"}, "--width takes a value (INT), and none follows it (see lumi-test --help)"},
      {{"in", "--width", "wide"}, "--width takes 1 to 100, not wide (see lumi-test --help)"},
      {{"simplify", "--faces", "few"}, "--faces takes a whole number, not few (see lumi-test simplify --help)"},
      {{"in", "--show", "tesselation"},
       "--show: takes color, tessellation, not tesselation; did you mean tessellation?"},
      {{"in", "--kind", "sqare"}, "--kind: takes round, square, not sqare; did you mean square?"},
      {{"in", "--kind", "0"}, "--kind: takes round, square, not 0"}};
  for (const auto& [args, said] : cases) {
    const Outcome o = StartWithOptions(args);
    EXPECT_EQ(o.code, 2) << said;
    EXPECT_NE(o.err.find(said), std::string::npos) << said << "\n" << o.err;
    EXPECT_EQ(std::count(o.err.begin(), o.err.end(), '\n'), 1) << o.err;
  }
}

// An option that is read and does nothing would pass for one that was obeyed.
TEST(CommandLine, AnOptionThatTheCommandHasNoUseForIsRefused) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
      {{"simplify", "--show", "color"}, "--show is no option of lumi-test simplify (it is one of lumi-test itself; "},
      {{"--show", "color", "simplify"}, "--show is no option of lumi-test simplify (it is one of lumi-test itself; "},
      {{"info", "--kind", "round"}, "--kind is no option of lumi-test info"},
      {{"simplify", "--depth", "3"}, "--depth is no option of lumi-test simplify"}};
  for (const auto& [args, said] : cases) {
    const Outcome o = StartWithOptions(args);
    EXPECT_EQ(o.code, 2) << said;
    EXPECT_NE(o.err.find(said), std::string::npos) << said << "\n" << o.err;
  }
  for (const auto& args : {std::vector<std::string>{"info", "--show", "color", "--threads", "1"},
                           {"--depth", "3", "info"},
                           {"simplify", "--width", "3", "--faces", "3", "--quiet"}})
    EXPECT_EQ(StartWithOptions(args).code, 0) << args.front();
}

TEST(CommandLine, HelpListsTheWordsThatAnOptionTakes) {
  const Outcome o = StartWithOptions({"--help"});
  EXPECT_NE(o.out.find("--kind round|square"), std::string::npos) << o.out;
  EXPECT_NE(o.out.find("--show color|tessellation"), std::string::npos) << o.out;
  EXPECT_EQ(o.out.find("->"), std::string::npos) << o.out;
}

TEST(CommandLine, QuietPrintsWhatWasAskedFor) {
  EXPECT_EQ(StartWithOptions({"in", "--quiet"}).out, "");
  EXPECT_EQ(StartWithOptions({"in", "--kind", "square", "--quiet"}).out, "square\n");
  EXPECT_EQ(StartWithOptions({"in", "--kind", "square"}).out, "width 0\nand more\n");
}

TEST(Program, AFailureIsOneLineWhateverAFileIsCalled) {
  const Outcome o = Start({"--json"}, []() -> std::string { throw InputError("two\nlines\xff.jpg", "is cut off"); });
  EXPECT_EQ(o.err, "lumi-test: two\\nlines\\xff.jpg: is cut off\n");
  EXPECT_EQ(nlohmann::json::parse(o.out)["error"]["file"], "two\\nlines\\xff.jpg");
  EXPECT_EQ(Printable("gr\xc3\xbc\xc3\x9f e"), "gr\xc3\xbc\xc3\x9f e");
  EXPECT_TRUE(IsUtf8("gr\xc3\xbc\xc3\x9f"));
  // Cut off, longer than need be, a surrogate, beyond the last character.
  for (const char* text : {"\xc3", "\xc0\xaf", "\xed\xa0\x80", "\xf4\x90\x80\x80", "caf\xe9"})
    EXPECT_FALSE(IsUtf8(text)) << Printable(text);
}

TEST(WithError, BothHaveTheDeviationsSecondDigit) {
  EXPECT_EQ(WithError(15.3700123, 0.0000312), "15.370012 +- 0.000031");
  EXPECT_EQ(WithError(21.21, 0.26), "21.21 +- 0.26");
  EXPECT_EQ(WithError(150.3514, 2.5, " &#177; "), "150.4 &#177; 2.5");
  EXPECT_EQ(WithError(1503.7, 250), "1504 +- 250");
  EXPECT_EQ(WithError(15.37, 1e-14), "15.370000000 +- 1e-14");  // nine decimals at most
  EXPECT_EQ(WithError(15.37, 0), "15.37");
  EXPECT_EQ(WithError(15.37, std::numeric_limits<double>::quiet_NaN()), "15.37");
}

// The words that a shell offers next.
std::string Next(std::vector<std::string> line) {
  line.insert(line.begin(), "--complete");
  std::vector<std::string> args = {"lumi-test"};
  args.insert(args.end(), line.begin(), line.end());
  std::vector<char*> argv;
  for (auto& a : args) argv.push_back(a.data());
  Program program("lumi-test", "a test");
  std::string how;
  int width = 0;
  program.options().Add("--how", how, "").OneOf({"smooth", "sharp", "off"});
  program.options().Add("--width", width, "");
  Options fine = program.Command("fine", "", [] { return Answer(*JsonKeys::Parse("{}"), ""); }, {"--width"});
  int faces = 0;
  fine.Add("--faces", faces, "");
  testing::internal::CaptureStdout();
  EXPECT_EQ(program.Run(static_cast<int>(argv.size()), argv.data()), 0);
  return testing::internal::GetCapturedStdout();
}

TEST(Program, TellsAShellWhatMayStandNext) {
  EXPECT_EQ(Next({"--wi"}), "--width\n");
  EXPECT_EQ(Next({"--how", "s"}), "smooth\nsharp\n");
  EXPECT_EQ(Next({"--how", ""}), "smooth\nsharp\noff\n");
  EXPECT_EQ(Next({"--width", ""}), "");  // a number
  EXPECT_EQ(Next({"fi"}), "fine\n");
  EXPECT_EQ(Next({"fine", "--fa"}), "--faces\n");
  EXPECT_EQ(Next({"--fa"}), "");
  EXPECT_EQ(Next({"fine", "--wi"}), "--width\n");  // of the program's own options those that the command takes
  EXPECT_EQ(Next({"fine", "--ho"}), "");
  EXPECT_EQ(Next({"scene/", "x"}), "");
  EXPECT_EQ(Next({}), "fine\n");
}

}  // namespace
}  // namespace lumi
