// SPDX-License-Identifier: Apache-2.0
using System.Collections.Generic;
using UnityEngine;

namespace StereoCell
{
    /// <summary>A spatial tile, shown by its surfaces, by its volume, or by both. Its voxels are loaded when they are to
    /// be shown; until then its surfaces stay.</summary>
    [DisallowMultipleComponent, AddComponentMenu("StereoCell/Tile")]
    public sealed class Tile : MonoBehaviour
    {
        public GameObject surfaces;
        public GameObject volume;

        VolumeBox[] boxes;
        bool keepsSurfaces;

        public bool ShowsVolume
        {
            get { return volume != null && volume.activeSelf; }
        }

        /// <summary>Whether its voxels are on their way.</summary>
        public bool IsLoading { get; private set; }

        /// <summary>Share of its voxels that are there, 0 to 1.</summary>
        public float Progress
        {
            get
            {
                float sum = 0, count = 0;
                foreach (var box in Boxes())
                {
                    if (!box.IsShown) continue;
                    sum += box.Progress;
                    count++;
                }
                return count == 0 ? 1 : sum / count;
            }
        }

        /// <summary>The most memory that its voxels take, while they are loaded.</summary>
        public long PeakBytes
        {
            get
            {
                var sizes = new List<KeyValuePair<int[], int>>();
                foreach (var box in Boxes()) sizes.Add(new KeyValuePair<int[], int>(box.size, box.channels.Length));
                return VolumeMemory.PeakBytes(sizes);
            }
        }

        public void Show(bool withSurfaces, bool withVolume)
        {
            var specimen = GetComponentInParent<Specimen>(true);
            IsLoading = withVolume && volume != null && specimen != null;
            keepsSurfaces = withSurfaces;
            if (!IsLoading)
            {
                if (surfaces != null) surfaces.SetActive(withSurfaces);
                if (volume != null) volume.SetActive(withVolume);
                return;
            }
            specimen.Load(this);
        }

        /// <summary>From surfaces to the volume, and back.</summary>
        [ContextMenu("Switch between surfaces and volume")]
        public void Switch()
        {
            var hides = ShowsVolume || IsLoading;
            Show(hides, !hides);
        }

        /// <summary>Go on loading; show the volume once it is whole. The specimen calls it each frame.</summary>
        public void Advance(long mostBytes)
        {
            foreach (var box in Boxes())
            {
                if (box.IsShown && !box.Advance(mostBytes)) return;
            }
            if (!IsLoading) return;
            IsLoading = false;
            volume.SetActive(true);
            if (surfaces != null) surfaces.SetActive(keepsSurfaces);
        }

        /// <summary>Give the voxels' memory back and show the surfaces.</summary>
        public void Unload()
        {
            IsLoading = false;
            foreach (var box in Boxes()) box.Unload();
            if (volume != null) volume.SetActive(false);
            if (surfaces != null) surfaces.SetActive(true);
        }

        VolumeBox[] Boxes()
        {
            if (boxes == null) boxes = volume == null ? new VolumeBox[0] : volume.GetComponentsInChildren<VolumeBox>(true);
            return boxes;
        }
    }
}
