#include "gamer/core/build_identity.h"

#include <elf.h>
#include <fmt/format.h>
#include <gnu/libc-version.h>
#include <link.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>

#include "gamer/core/simd.h"

namespace gamer {
namespace {

using Bytes = std::span<const unsigned char>;

/// An address in this library's code.
const char code_marker = 0;

/// The build ID among the notes of an ELF segment, as hexadecimal digits; may be empty.
std::string id_among(Bytes notes) {
  // Names and descriptions begin at multiples of four bytes.
  const auto padded = [](std::size_t size) { return (size + 3) & ~std::size_t{3}; };
  ElfW(Nhdr) head;
  while (notes.size() >= sizeof head) {
    std::memcpy(&head, notes.data(), sizeof head);
    const std::size_t text = sizeof head + padded(head.n_namesz);
    const std::size_t size = text + padded(head.n_descsz);
    if (size > notes.size()) break;
    const std::string_view name(reinterpret_cast<const char*>(notes.data()) + sizeof head,
                                head.n_namesz);
    if (head.n_type == NT_GNU_BUILD_ID && name == std::string_view("GNU", 4)) {
      return fmt::format("{:02x}", fmt::join(notes.subspan(text, head.n_descsz), ""));
    }
    notes = notes.subspan(size);
  }
  return {};
}

/// A callback of dl_iterate_phdr() that takes the build ID of the program or shared library that
/// holds code_marker. A result other than 0 ends the iteration.
int take_id(dl_phdr_info* object, std::size_t, void* id) {
  const auto segments = std::span(object->dlpi_phdr, object->dlpi_phnum);
  const auto start = [&](const ElfW(Phdr) & segment) {
    return object->dlpi_addr + segment.p_vaddr;
  };
  const auto marker = reinterpret_cast<std::uintptr_t>(&code_marker);
  bool is_own = false;
  for (const ElfW(Phdr) & segment : segments) {
    is_own = is_own || (segment.p_type == PT_LOAD && marker >= start(segment) &&
                        marker - start(segment) < segment.p_memsz);
  }
  if (!is_own) return 0;
  auto& text = *static_cast<std::string*>(id);
  for (const ElfW(Phdr) & segment : segments) {
    if (segment.p_type != PT_NOTE || !text.empty()) continue;
    text = id_among({reinterpret_cast<const unsigned char*>(start(segment)), segment.p_memsz});
  }
  return 1;
}

/// Whether the C library may use fused multiply-adds, which round differently.
bool has_fused_arithmetic() {
#if defined(__x86_64__)
  return __builtin_cpu_supports("fma") != 0;
#else
  return true;
#endif
}

}  // namespace

std::string build_identity() {
  std::string id;
  dl_iterate_phdr(take_id, &id);
  if (id.empty()) return id;
  return fmt::format("{} {} {} {}", id, simd_target_name(current_simd_target()),
                     gnu_get_libc_version(), has_fused_arithmetic() ? "fma" : "");
}

}  // namespace gamer
