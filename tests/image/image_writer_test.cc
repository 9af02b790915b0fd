#include "gamer/image/image_writer.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <functional>
#include <string>

#include "gamer/core/error.h"
#include "image/image_test_util.h"

namespace gamer::image_writer_test {
namespace {

const std::vector<double> two = {4400, 5500};

std::string message_of(const OutputOptions& options, const ImageHeader& header) {
  try {
    check_output(options, header);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// Runs `body` in a child process, whose limits `body` may change; returns its result.
int in_child(const std::function<int()>& body) {
  const pid_t child = fork();
  if (child == 0) {
    int code = 1;
    try {
      code = body();
    } catch (...) {
    }
    _exit(code);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(OutputFiles, NamesFollowTheLayout) {
  const ImageHeader header = test_header(4, 4, two);
  using Paths = std::vector<std::filesystem::path>;
  EXPECT_EQ(output_files({"d/a.fits"}, header), Paths{"d/a.fits"});
  OutputOptions options{"d/a.b.fits.fz", -32, ImageLayout::files, false};
  EXPECT_EQ(output_files(options, header), (Paths{"d/a.b_4400A.fits.fz", "d/a.b_5500A.fits.fz"}));
  options.path = "a.fits";
  EXPECT_EQ(output_files(options, header), (Paths{"a_4400A.fits", "a_5500A.fits"}));
  options.path = "a.png";
  EXPECT_EQ(output_files(options, header), Paths{"a.png"});
}

TEST(CheckOutput, GoodOutputPassesAndLeavesNothing) {
  TemporaryFolder folder;
  const ImageHeader header = test_header(100, 100, two);
  for (const char* name : {"a.fits", "a.fits.fz", "a.png", "a.bmp"}) {
    EXPECT_EQ(message_of({folder / name}, header), "") << name;
  }
  EXPECT_EQ(folder.file_count(), 0U);
}

TEST(CheckOutput, UnknownSuffix) {
  TemporaryFolder folder;
  const ImageHeader header = test_header(4, 4, two);
  for (const char* name : {"a.jpg", "a.fit", "a", ".fits", "fits", "a.fits.gz", "a.FITS"}) {
    const std::string message = message_of({folder / name}, header);
    EXPECT_TRUE(contains(message, ".fits, .fits.fz, .png, .bmp")) << name << ": " << message;
  }
}

TEST(CheckOutput, WrongBitpix) {
  TemporaryFolder folder;
  EXPECT_TRUE(contains(message_of({folder / "a.fits", 16}, test_header(4, 4, two)), "bitpix = 16"));
}

TEST(CheckOutput, Folder) {
  TemporaryFolder folder;
  const ImageHeader header = test_header(4, 4, two);
  EXPECT_TRUE(contains(message_of({folder / "none/a.fits"}, header), "does not exist"));
  std::ofstream(folder / "file") << "x";
  EXPECT_NE(message_of({folder / "file/a.fits"}, header), "");
  std::filesystem::create_directory(folder / "b.fits");
  EXPECT_TRUE(contains(message_of({folder / "b.fits", -32, ImageLayout::cube, true}, header),
                       "is a folder"));
  EXPECT_NE(message_of({folder / (std::string(300, 'n') + ".fits")}, header), "");
  // This long name is one that the file system accepts.
  EXPECT_EQ(message_of({folder / (std::string(250, 'n') + ".fits")}, header), "");
}

TEST(CheckOutput, FolderThatCannotBeWritten) {
  if (geteuid() == 0) {
    // Root can write everywhere but in folders of the kernel.
    EXPECT_NE(message_of({"/proc/a.fits"}, test_header(4, 4, two)), "");
    return;
  }
  TemporaryFolder folder;
  const std::filesystem::path sealed = folder / "sealed";
  std::filesystem::create_directory(sealed);
  std::filesystem::permissions(
      sealed, std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec);
  EXPECT_TRUE(
      contains(message_of({sealed / "a.fits"}, test_header(4, 4, two)), "Permission denied"));
}

TEST(CheckOutput, ExistingFile) {
  TemporaryFolder folder;
  const ImageHeader header = test_header(4, 4, two);
  std::ofstream(folder / "a_5500A.fits") << "x";
  OutputOptions options{folder / "a.fits", -32, ImageLayout::files, false};
  EXPECT_TRUE(contains(message_of(options, header), "a_5500A.fits' exists"));
  EXPECT_THROW(make_image_writer(options, header), InputError);
  EXPECT_EQ(file_bytes(folder / "a_5500A.fits"), "x");
  options.overwrite = true;
  EXPECT_EQ(message_of(options, header), "");
  // A dangling link counts as an existing file.
  std::filesystem::create_symlink("nowhere", folder / "b.fits");
  EXPECT_TRUE(contains(message_of({folder / "b.fits"}, header), "exists"));
}

TEST(CheckOutput, Labels) {
  TemporaryFolder folder;
  ImageHeader header = test_header(4, 4, two);
  const OutputOptions options{folder / "a.fits", -32, ImageLayout::files, false};
  header.labels = {"a", "a"};
  EXPECT_TRUE(contains(message_of(options, header), "label 'a'"));
  header.labels = {"a", "b/c"};
  EXPECT_TRUE(contains(message_of(options, header), "'b/c'"));
}

TEST(CheckOutput, DiskTooSmall) {
  TemporaryFolder folder;
  const ImageHeader header = test_header(1000000, 1000000, two);
  const std::string message = message_of({folder / "a.fits", -64}, header);
  // 1e12 pixels of 8 bytes in 2 planes.
  EXPECT_TRUE(contains(message, "needs 14.6 TiB on disk")) << message;
}

TEST(CheckOutput, PictureTooLarge) {
  TemporaryFolder folder;
  const ImageHeader header = test_header(1000000, 1000000, two);
  // A pixel takes 3 channels of 8 bytes, and 6 bytes of the picture.
  const std::string message = message_of({folder / "a.png"}, header);
  EXPECT_TRUE(contains(message, "needs 21.8 TiB of memory")) << message;
  EXPECT_TRUE(contains(message_of({folder / "a.bmp"}, header), "4 GiB"));
}

TEST(CheckOutput, PictureBeyondTheAddressSpaceLimit) {
  TemporaryFolder folder;
  const OutputOptions options{folder / "a.png"};
  const ImageHeader header = test_header(4000, 4000, two);
  EXPECT_EQ(message_of(options, header), "");
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitizer needs the whole address space";
#endif
  EXPECT_EQ(in_child([&] {
              // 16 million pixels of 30 bytes are 458 MiB.
              const rlimit limit{rlim_t{400} << 20, rlim_t{400} << 20};
              setrlimit(RLIMIT_AS, &limit);
              return contains(message_of(options, header), "of memory") ? 42 : 2;
            }),
            42);
}

TEST(CheckOutput, MoreFilesThanCanBeOpen) {
  TemporaryFolder folder;
  std::vector<double> wavelengths;
  for (int i = 0; i < 200; ++i) wavelengths.push_back(4000 + i);
  const ImageHeader header = test_header(4, 4, wavelengths);
  const OutputOptions options{folder / "a.fits", -32, ImageLayout::files, false};
  EXPECT_EQ(message_of(options, header), "");
  EXPECT_EQ(in_child([&] {
              const rlimit limit{128, 128};
              setrlimit(RLIMIT_NOFILE, &limit);
              return contains(message_of(options, header), "ulimit -n") ? 42 : 2;
            }),
            42);
}

}  // namespace
}  // namespace gamer::image_writer_test
