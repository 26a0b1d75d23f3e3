# SPDX-License-Identifier: Apache-2.0
set -l commands render submit status list watch cancel pause resume priority workers drain reset serve fsck backup restore config token worker cert version
complete -c penumbra -n "not __fish_seen_subcommand_from $commands" -f -a "$commands"
complete -c penumbra -n "not __fish_seen_subcommand_from $commands" -l version
complete -c penumbra -l help
complete -c penumbra -n "__fish_seen_subcommand_from render" -s o -l output -r -d "image file"
complete -c penumbra -n "__fish_seen_subcommand_from render submit" -l samples -x -d "per pixel"
complete -c penumbra -n "__fish_seen_subcommand_from render submit" -l size -x -d "WxH in pixels"
complete -c penumbra -n "__fish_seen_subcommand_from render submit" -l crop -x -d "L,T,R,B in pixels"
complete -c penumbra -n "__fish_seen_subcommand_from render submit" -l seed -x
complete -c penumbra -n "__fish_seen_subcommand_from render submit" -l frames -x -d "first-last"
complete -c penumbra -n "__fish_seen_subcommand_from render submit" -l mode -x -a "uniform edge adaptive interleaved"
complete -c penumbra -n "__fish_seen_subcommand_from render submit" -l aperture-radius -x -d "of the lens"
complete -c penumbra -n "__fish_seen_subcommand_from render submit" -l focus-distance -x
complete -c penumbra -n "__fish_seen_subcommand_from render submit" -l time -x -d "second at which the shutter opens"
complete -c penumbra -n "__fish_seen_subcommand_from render submit" -l shutter -x -d "seconds that it is open"
complete -c penumbra -n "__fish_seen_subcommand_from render submit" -l background -x -d "R,G,B"
complete -c penumbra -n "__fish_seen_subcommand_from render serve" -l processes -x
complete -c penumbra -n "__fish_seen_subcommand_from render serve" -l isa -x -a "v2 v3 v4"
complete -c penumbra -n "__fish_seen_subcommand_from render watch" -l quiet
complete -c penumbra -n "__fish_seen_subcommand_from submit status list watch cancel pause resume priority workers drain reset" -l server -x
complete -c penumbra -n "__fish_seen_subcommand_from render submit status list watch cancel pause resume priority workers drain reset" -l json -d "print JSON"
complete -c penumbra -n "__fish_seen_subcommand_from serve" -l listen -x
complete -c penumbra -n "__fish_seen_subcommand_from serve" -l listen-unix -r
complete -c penumbra -n "__fish_seen_subcommand_from serve" -l worker-listen -x
complete -c penumbra -n "__fish_seen_subcommand_from serve fsck backup restore token worker cert" -l data -r
complete -c penumbra -n "__fish_seen_subcommand_from fsck" -l repair
complete -c penumbra -n "__fish_seen_subcommand_from serve" -l tile -x
complete -c penumbra -n "__fish_seen_subcommand_from serve" -l keep-assets -x -d "hours"
complete -c penumbra -n "__fish_seen_subcommand_from serve" -l keep-renders -x -d "hours"
complete -c penumbra -n "__fish_seen_subcommand_from serve" -l keep-frames -x -d "MiB"
complete -c penumbra -n "__fish_seen_subcommand_from serve" -l max-waiting -x -d "renders"
complete -c penumbra -n "__fish_seen_subcommand_from serve" -l sandbox -x -a "require best-effort off"
complete -c penumbra -n "__fish_seen_subcommand_from serve" -l log-level -x -a "error warning info debug"
complete -c penumbra -n "__fish_seen_subcommand_from serve" -l log-format -x -a "text json"
complete -c penumbra -n "__fish_seen_subcommand_from serve" -l config -r -d "settings"
complete -c penumbra -n "__fish_seen_subcommand_from serve" -l parent-death -d "end with the parent"
complete -c penumbra -n "__fish_seen_subcommand_from submit status list watch cancel pause resume priority workers drain reset" -l token-file -r -d "what the server knows us by"
complete -c penumbra -n "__fish_seen_subcommand_from submit status list watch cancel pause resume priority workers drain reset" -l ca-file -r -d "certificates to trust"
complete -c penumbra -n "__fish_seen_subcommand_from serve token" -l tokens -r -d "file of tokens"
complete -c penumbra -n "__fish_seen_subcommand_from serve" -l tls-cert -r -d "certificate of HTTP"
complete -c penumbra -n "__fish_seen_subcommand_from serve" -l tls-key -r -d "its key"
complete -c penumbra -n "__fish_seen_subcommand_from cert" -l cert -r -d "file for the certificate"
complete -c penumbra -n "__fish_seen_subcommand_from cert" -l key -r -d "file for its key"
complete -c penumbra -n "__fish_seen_subcommand_from token worker" -x -a "add list remove"
complete -c penumbra -n "__fish_seen_subcommand_from token" -l scope -x -d "of submit, read, metrics, admin"
complete -c penumbra -n "__fish_seen_subcommand_from token worker" -l output -r -d "file for the secret"
complete -c penumbra -n "__fish_seen_subcommand_from serve worker" -l worker-keys -r -d "file of keys"
complete -c penumbra -n "__fish_seen_subcommand_from config" -x -a "check"

complete -c penumbra-worker -l connect -x -d "coordinator"
complete -c penumbra-worker -l processes -x
complete -c penumbra-worker -l name -x -d "shown in lists"
complete -c penumbra-worker -l isa -x -a "v2 v3 v4"
complete -c penumbra-worker -l sandbox -x -a "require best-effort off"
complete -c penumbra-worker -l asset-cache -x -d "MiB"
complete -c penumbra-worker -l log-level -x -a "error warning info debug"
complete -c penumbra-worker -l log-format -x -a "text json"
complete -c penumbra-worker -l key-file -r -d "of penumbra worker add"
complete -c penumbra-worker -l key-fd -x
complete -c penumbra-worker -l parent-death -d "end with the parent"
complete -c penumbra-worker -l help
complete -c penumbra-worker -l version
