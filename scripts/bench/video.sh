#!/usr/bin/env bash
# Reading videos: frames a second of 1080p beside the decoder alone and OpenCV's reader
# Programs: video_bench
. "${BASH_SOURCE[0]%/*}/common.sh"

clip=$work/video-1080p.mp4
[ -f "$clip" ] || {
  ffmpeg -nostdin -y -loglevel error -f lavfi -i testsrc2=s=1920x1080:r=30:d=10 -vf noise=alls=6:allf=t -c:v libx264 -preset fast -crf 23 -pix_fmt yuv420p "$work/video-part.mp4"
  mv "$work/video-part.mp4" "$clip"
}
printf '\n## Reading a video of 1080p\n\n'
"$bin/video_bench" "$clip"
