#include "image/output_file.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include "core/message.h"
#include "image/standard_stream.h"

namespace gamer {

OutputFile::OutputFile(const std::filesystem::path& name) : label_(output_label(name)) {
  if (name == standard_stream) {
    spool_.emplace();
  } else {
    temporary_.emplace(name);
  }
}

const std::filesystem::path& OutputFile::path() const {
  return spool_ ? spool_->path() : temporary_->path();
}

void OutputFile::deliver(bool overwrite) {
  if (temporary_) {
    temporary_->move_to_final(overwrite);
    return;
  }
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> whole(
      std::fopen(spool_->path().c_str(), "rb"), &std::fclose);
  if (!whole) throw run_error("{}: {}", label_, std::strerror(errno));
  copy_bytes(whole.get(), stdout, label_);
}

std::string output_label(const std::filesystem::path& name) {
  return name == standard_stream ? "standard output" : name.string();
}

}  // namespace gamer
