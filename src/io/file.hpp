// SPDX-License-Identifier: Apache-2.0
/// @file
/// Whole files in and out: reading with clear errors, atomic writing, digests.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace trammel::io {

/// The bytes of a file; Error if it cannot be read or is a folder.
[[nodiscard]] std::string read_text(const std::filesystem::path& file);

/// What a written file has to survive.
enum class Durability {
  kPowerFailure,  ///< the content is on the disk before the name shows it (several milliseconds)
  kKill,          ///< the death of the process; for files that tell by their content whether they are whole
};

/// Writes a file so that the name holds either the old content or the whole new one: a temporary file
/// beside it, then a rename. On an error or an interrupt the temporary file is removed. Error if it cannot
/// be written.
void write_atomically(const std::filesystem::path& file, std::string_view content,
                      Durability durability = Durability::kPowerFailure);

/// Creates a folder with its parents; Error if that fails or something else has the name.
void create_folder(const std::filesystem::path& folder);

/// Removes unfinished temporary files and ends the process with status 130 on SIGINT, 143 on SIGTERM.
void install_interrupt_handler();

/// SHA-256 in lower-case hexadecimal.
[[nodiscard]] std::string sha256(std::string_view content);

}  // namespace trammel::io
